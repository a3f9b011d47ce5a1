import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from taskslam.datasets.trajectory_files import read_trajectory_file, split_topic
from taskslam.errors import TrajectoryError
from taskslam.record.trajectories import SpatialTrajectory

GOOD = [f"1403636580.{5 * row:02d} {row} 0.5 -1 0 0 0 1" for row in range(6)]


def write(folder, lines, name="run.tum"):
    path = folder / name
    path.write_text("\n".join(lines) + "\n")
    return path


def refusal(path, times=None):
    with pytest.raises(TrajectoryError) as caught:
        read_trajectory_file(str(path), times)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_tum_file(tmp_path):
    read = read_trajectory_file(str(write(tmp_path, ["# head", *GOOD])))
    assert read.notes == ()
    assert read.trajectory.stamps[1] == 1403636580_050000000
    np.testing.assert_array_equal(read.trajectory.positions[3], [3, 0.5, -1])


def test_a_euroc_csv_has_nanoseconds_and_the_real_part_first(tmp_path):
    turn = Rotation.from_rotvec([0.1, 0.2, 0.3]).as_quat()
    words = [1403636580838555648, 4.5, -1.7, 0.8, turn[3], *turn[:3], 0.1, 0.2]
    head = "#timestamp, p_RS_R_x [m], ..."
    second = [1403636580888555648, *words[1:]]
    lines = [head, *(", ".join(map(str, row)) for row in (words, second))]
    trajectory = read_trajectory_file(str(write(tmp_path, lines, "data.csv"))).trajectory
    assert trajectory.stamps.tolist() == [1403636580838555648, 1403636580888555648]
    np.testing.assert_allclose(trajectory.quaternions[0], turn, atol=1e-15)


def test_kitti_poses_take_their_stamps_from_a_times_file(tmp_path):
    turns = Rotation.from_rotvec([[0, 0, 0], [0, 0.1, 0], [0, 0.2, 0]])
    rows = np.concatenate([turns.as_matrix(), np.arange(9.0).reshape(3, 3, 1)], axis=2).reshape(3, 12)
    path = write(tmp_path, [" ".join(map(repr, row)) for row in rows.tolist()], "00.txt")
    times = write(tmp_path, ["0.000000e+00", "1.037e-01", "2.074e-01"], "times.txt")
    trajectory = read_trajectory_file(str(path), times).trajectory
    assert trajectory.stamps.tolist() == [0, 103_700_000, 207_400_000]
    np.testing.assert_allclose(trajectory.positions[1], [3, 4, 5])
    np.testing.assert_allclose(trajectory.quaternions, turns.as_quat(), atol=1e-12)
    assert "give a times file" in refusal(path)
    assert "holds 3 poses" in refusal(path, write(tmp_path, ["0", "1"], "short.txt"))
    skewed = [" ".join(map(repr, row)) for row in (2 * rows).tolist()]
    assert "00.txt, line 1: expected a rotation" in refusal(write(tmp_path, skewed, "00.txt"), times)


def test_an_empty_file(tmp_path):
    assert refusal(write(tmp_path, [""])).endswith("run.tum: holds no pose; expected at least one")
    assert "holds no pose" in refusal(write(tmp_path, ["# only a head"]))


def test_a_truncated_last_line_is_left_out_and_noted(tmp_path):
    path = write(tmp_path, GOOD)
    path.write_text(path.read_text()[:-9])
    read = read_trajectory_file(str(path))
    assert len(read.trajectory) == 5
    assert read.notes == ("the last line was cut off and is left out",)


def test_a_truncated_line_in_the_middle_costs_that_line(tmp_path):
    read = read_trajectory_file(str(write(tmp_path, [*GOOD[:2], GOOD[2][:20], *GOOD[3:]])))
    assert read.trajectory.positions[:, 0].tolist() == [0, 1, 3, 4, 5]
    assert read.notes == ("1 lines are no poses and left out (first: line 3)",)


def test_a_file_of_which_more_is_wrong_than_right_is_refused(tmp_path):
    lines = [*GOOD[:2], *(line[:20] for line in GOOD[2:])]
    assert "run.tum, line 3: expected eight numbers" in refusal(write(tmp_path, lines))
    assert "of 5 columns" in refusal(write(tmp_path, ["1 2 3 4 5", "2 3 4 5 6"]))


def test_poses_that_are_not_finite_are_left_out_and_noted(tmp_path):
    lines = [*GOOD[:2], "1403636580.1 nan nan nan nan nan nan nan", *GOOD[3:]]
    read = read_trajectory_file(str(write(tmp_path, lines)))
    assert len(read.trajectory) == 5
    assert "1 of 6 poses are not finite and left out" in read.notes[0]
    assert "run.tum, line 3" in read.notes[0]
    assert "holds no pose" in refusal(write(tmp_path, ["1 nan 0 0 0 0 0 1"]))


def test_duplicate_stamps_keep_the_first_and_are_noted(tmp_path):
    read = read_trajectory_file(str(write(tmp_path, [*GOOD[:3], GOOD[2].replace(" 2 ", " 9 "), *GOOD[3:]])))
    assert read.trajectory.positions[:, 0].tolist() == [0, 1, 2, 3, 4, 5]
    assert "1 poses have the stamp of the one before" in read.notes[0]
    assert "line 4" in read.notes[0]


def test_a_stamp_out_of_order_costs_that_pose(tmp_path):
    for lines, place in (([*GOOD[:2], GOOD[5], *GOOD[2:5]], 3), ([*GOOD[1:5], GOOD[0], GOOD[5]], 5)):
        read = read_trajectory_file(str(write(tmp_path, lines)))
        assert len(read.trajectory) == 5
        assert (np.diff(read.trajectory.stamps) > 0).all()
        (note,) = read.notes
        assert note.startswith("1 of 6 poses have stamps out of order and are left out (first: ")
        assert note.endswith(f"run.tum, line {place})")


def test_a_run_behind_another_is_an_error(tmp_path):
    assert "run.tum, line 7: time goes backwards, from 1403636580.250000000 s to 1403636580.000000000 s" in refusal(
        write(tmp_path, [*GOOD, *GOOD])
    )


def test_one_stamp_of_another_clock_or_unit_costs_that_pose(tmp_path):
    for odd in ("1403636580100000000 2 0 0 0 0 0 1", "1.40363658 2 0 0 0 0 0 1"):
        read = read_trajectory_file(str(write(tmp_path, [*GOOD[:2], odd, *GOOD[3:], *later(20)])))
        assert len(read.trajectory) == 25
        assert len(read.notes) == 1
        assert "left out (first: " in read.notes[0]
        assert "line 3" in read.notes[0]


def test_stamps_of_two_clocks_are_an_error(tmp_path):
    lines = [*GOOD[:3], "1.5 2 0 0 0 0 0 1", "1.6 2 0 0 0 0 0 1"]
    assert "line 4: the stamp leaps from 1403636580.100000000 s to 1.500000000 s" in refusal(write(tmp_path, lines))


def later(count):
    return [f"1403636590.{row:02d} {row} 0.5 -1 0 0 0 1" for row in range(count)]


@pytest.mark.parametrize(("quaternion", "length"), [("0 0 0 0", "0"), ("0 0 0 2", "2"), ("1 1 1 1", "2")])
def test_a_quaternion_that_is_not_of_unit_length_costs_that_pose(tmp_path, quaternion, length):
    read = read_trajectory_file(str(write(tmp_path, [*GOOD[:3], f"1403636580.15 3 0 0 {quaternion}", *GOOD[4:]])))
    assert read.trajectory.positions[:, 0].tolist() == [0, 1, 2, 4, 5]
    (note,) = read.notes
    assert note.startswith("1 of 6 poses have no unit quaternion and are left out (first: ")
    assert note.endswith(f"run.tum, line 4, of length {length})")
    wrong = [f"{row} 3 0 0 {quaternion}" for row in range(4)]
    assert f"line 1: expected a unit quaternion, found one of length {length}" in refusal(write(tmp_path, wrong))


@pytest.mark.parametrize("decimals", [2, 3, 4, 9])
def test_rounded_quaternions_are_normalised_and_noted(tmp_path, decimals):
    turns = Rotation.random(200, np.random.default_rng(1)).as_quat()
    lines = [f"{row} 0 0 0 " + " ".join(f"{q:.{decimals}f}" for q in turn) for row, turn in enumerate(turns)]
    read = read_trajectory_file(str(write(tmp_path, lines)))
    assert len(read.trajectory) == 200
    assert np.allclose(np.linalg.norm(read.trajectory.quaternions, axis=1), 1.0, atol=1e-15)
    off = Rotation.from_quat(turns).inv() * Rotation.from_quat(read.trajectory.quaternions)
    assert off.magnitude().max() < 3 * 10.0**-decimals
    assert [("quaternions are rounded" in note) for note in read.notes] == ([True] if decimals < 3 else [])


def test_kitti_poses_rounded_to_three_decimals_are_made_rotations_again(tmp_path):
    turns = Rotation.random(50, np.random.default_rng(2))
    rows = np.concatenate([turns.as_matrix(), np.zeros((50, 3, 1))], axis=2).reshape(50, 12)
    times = write(tmp_path, [f"{row / 10:.6e}" for row in range(50)], "times.txt")
    lines = [" ".join(f"{value:.3f}" for value in row) for row in rows]
    read = read_trajectory_file(str(write(tmp_path, lines, "00.txt")), times)
    off = turns.inv() * Rotation.from_quat(read.trajectory.quaternions)
    assert off.magnitude().max() < 2e-3
    assert "matrices are rounded" in read.notes[0]
    lines[7] = " ".join(["0"] * 12)
    read = read_trajectory_file(str(write(tmp_path, lines, "00.txt")), times)
    assert len(read.trajectory) == 49
    assert any("1 matrices are no rotations" in note and "line 8" in note for note in read.notes)


POSE = {"x": 1, "y": 2, "z": 3, "qx": 4, "qy": 5, "qz": 6, "qw": 7}
HEADERS = {
    "tum": {"stamp": "timestamp", **{name: name if name[0] == "q" else f"t{name}" for name in POSE}},
    "euroc": {"stamp": "timestamp", **{n: f"q_RS_{n[1]} []" if n[0] == "q" else f"p_RS_R_{n} [m]" for n in POSE}},
    "plain": {"stamp": "time", **{name: name for name in POSE}},
    "rostopic": {
        "stamp": "field.header.stamp",
        **{n: f"field.pose.orientation.{n[1]}" if n[0] == "q" else f"field.pose.position.{n}" for n in POSE},
    },
}


@given(
    style=st.sampled_from(sorted(HEADERS)), order=st.permutations(["stamp", *POSE]),
    separator=st.sampled_from([",", ", ", ";"]), unit=st.sampled_from([1, 1000, 10**6, 10**9]),
    extra=st.sampled_from(["", "frame_id", "v_RS_R_x [m s^-1]", "covariance"]), bare=st.booleans(),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]), ending=st.sampled_from(["\n", "\r\n"]),
)  # fmt: skip
@settings(max_examples=150, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
def test_a_header_names_columns_in_any_order(tmp_path, style, order, separator, unit, extra, bare, encoding, ending):
    rng = np.random.default_rng(3)
    stamps = 1_403_636_580_838_000_000 + 50_000_000 * np.arange(12)
    turns = Rotation.random(12, rng).as_quat()
    values = np.column_stack([rng.normal(size=(12, 3)), turns])
    columns = [*order[:3], "extra", *order[3:]] if extra else order
    word = {1: "[ns]", 1000: "[us]", 10**6: "[ms]", 10**9: "[s]"}[unit]
    names = {**HEADERS[style], "extra": extra}
    names["stamp"] += f" {word}"
    lines = [("" if bare else "#") + separator.join(names[column] for column in columns)]
    for stamp, row in zip(stamps.tolist(), values.tolist(), strict=True):
        texts = {"stamp": f"{stamp // unit}" + (f".{stamp % unit:0{len(str(unit)) - 1}d}" if unit > 1 else "")}
        texts |= {name: repr(row[place - 1]) for name, place in POSE.items()} | {"extra": "odom"}
        lines.append(separator.join(texts[column] for column in columns))
    path = tmp_path / "est.csv"
    path.write_bytes((ending.join(lines) + ending).encode(encoding))
    read = read_trajectory_file(str(path))
    assert read.trajectory.stamps.tolist() == stamps.tolist()
    assert np.array_equal(read.trajectory.positions, values[:, :3])
    assert np.allclose(read.trajectory.quaternions, turns, atol=1e-15)
    assert all("header" in note for note in read.notes)


@pytest.mark.parametrize(("unit", "name"), [(1, "nanoseconds"), (1000, "microseconds"), (10**6, "milliseconds")])
@pytest.mark.parametrize("first", [0, 1_403_636_580_838_000_000])
@pytest.mark.parametrize("fraction", ["", ".000000"])
def test_stamps_in_another_unit_are_known_by_their_steps(tmp_path, unit, name, first, fraction):
    stamps = first + 50_000_000 * np.arange(30)
    path = write(tmp_path, [f"{stamp // unit}{fraction} 0 0 0 0 0 0 1" for stamp in stamps.tolist()], "f_kitti.txt")
    assert read_trajectory_file(str(path), unit=name).trajectory.stamps.tolist() == stamps.tolist()
    truth = SpatialTrajectory(stamps, np.zeros((30, 3)), np.tile([0.0, 0, 0, 1], (30, 1)))
    read = read_trajectory_file(str(path), truth=truth)
    if name == "milliseconds" and first == 0:  # 50 may be seconds, too
        assert read_trajectory_file(str(path)).trajectory.stamps[1] == 50_000_000_000
    else:
        assert read_trajectory_file(str(path)).notes == read.notes
    assert read.trajectory.stamps.tolist() == stamps.tolist()
    assert read.notes[0].startswith(f"stamps are taken for {name}, where seconds are usual")


def test_a_unit_that_is_open_is_asked_for_with_both_candidates(tmp_path):
    path = write(tmp_path, [f"{1_700_000_000_000 + 1500 * row} 0 0 0 0 0 0 1" for row in range(9)])
    assert read_trajectory_file(str(path)).trajectory.stamps[1] == 1_700_000_001_500_000_000
    path = write(tmp_path, [f"{9 * 10**11 + 3 * 10**6 * row} 0 0 0 0 0 0 1" for row in range(9)])
    assert refusal(path).endswith("which may be microseconds or nanoseconds; say --time-unit")


def test_commas_without_a_header_are_said(tmp_path):
    seconds = [",".join(line.split()) for line in GOOD]
    for name in ("est.txt", "est.csv"):
        read = read_trajectory_file(str(write(tmp_path, seconds, name)))
        assert read.trajectory.quaternions[0].tolist() == [0, 0, 0, 1]
        assert any("the quaternion is taken for x y z w" in note for note in read.notes)
    euroc = [f"{1403636580000000000 + 50000000 * row},{row},0.5,-1,1,0,0,0" for row in range(6)]
    read = read_trajectory_file(str(write(tmp_path, euroc, "est.csv")))
    assert (read.trajectory.quaternions[0].tolist(), read.notes) == ([0, 0, 0, 1], ())
    read = read_trajectory_file(str(write(tmp_path, euroc, "est.txt")))
    assert any("the quaternion is taken for w x y z" in note for note in read.notes)


def test_further_columns_behind_a_pose_are_left_out(tmp_path):
    head = "# timestamp(s) tx ty tz qx qy qz qw Pr11 Pr12 Pr13"
    covariance = [f"{line} 1e-5 1e-5 1e-5" for line in GOOD]
    read = read_trajectory_file(str(write(tmp_path, [head, *covariance])))
    assert (len(read.trajectory), read.notes) == (6, ())
    read = read_trajectory_file(str(write(tmp_path, covariance)))
    assert read.notes == ("of 11 columns the first eight are read: timestamp tx ty tz qx qy qz qw",)


def test_each_pose_twice_is_each_pose_once(tmp_path):
    read = read_trajectory_file(str(write(tmp_path, [line for line in GOOD for _ in range(2)])))
    assert read.trajectory.positions[:, 0].tolist() == [0, 1, 2, 3, 4, 5]
    assert read.notes[0].startswith("6 poses have the stamp of the one before and are left out")


@pytest.mark.parametrize("name", ["missing.tum", "missing.csv", "missing.txt", "missing.bag", "missing.mcap:/odom"])
def test_a_file_that_is_not_there(tmp_path, name):
    assert "missing" in refusal(tmp_path / name)


def test_a_folder_and_a_device(tmp_path):
    assert "found a folder, expected a file" in refusal(tmp_path)
    assert "found a pipe or a device, expected a file" in refusal("/dev/zero")


def test_a_colon_in_the_name_of_a_file_is_no_topic(tmp_path):
    assert split_topic(str(write(tmp_path, GOOD, "run:1.tum")))[1] is None
    assert split_topic("drive.bag:/odom")[1] == "/odom"
    assert split_topic("C:drive.tum")[1] is None


def test_poses_so_far_away_that_their_squares_overflow_are_left_out(tmp_path):
    path = write(tmp_path, [*GOOD, "1403636581.5 1e300 0 0 0 0 0 1"])
    read = read_trajectory_file(str(path))
    assert len(read.trajectory) == len(GOOD)
    assert "1 of 7 poses are not finite and left out" in read.notes[0]


def test_an_array_of_numpy_is_a_trajectory(tmp_path):
    stamps = 1_403_636_580 + 0.05 * np.arange(9)
    turns = Rotation.random(9, np.random.default_rng(1)).as_quat()
    table = np.column_stack([stamps, np.arange(27.0).reshape(9, 3), turns])
    np.save(tmp_path / "run.npy", table)
    read = read_trajectory_file(str(tmp_path / "run.npy"))
    assert np.abs(read.trajectory.stamps - np.round(stamps * 1e9)).max() < 300
    assert np.array_equal(read.trajectory.positions, table[:, 1:4])
    assert read.notes == ()
    for wrong, message in (
        (table[:, :7], r"an array \(9, 7\) of float64; expected \(N, 8\) numbers"),
        (table * 1e9, "row 0: expected seconds first"),
        (np.array([{}] * 8), "not a trajectory or cut short"),
    ):
        np.save(tmp_path / "wrong.npy", wrong, allow_pickle=True)
        with pytest.raises(TrajectoryError, match=message):
            read_trajectory_file(str(tmp_path / "wrong.npy"))
    (tmp_path / "cut.npy").write_bytes((tmp_path / "run.npy").read_bytes()[:-9])
    assert "which is not its size" in refusal(tmp_path / "cut.npy")
