import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from taskslam.datasets.trajectory_files import read_trajectory_file, split_topic
from taskslam.errors import TrajectoryError

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


def test_a_truncated_line_in_the_middle_is_an_error(tmp_path):
    assert "run.tum, line 3: expected eight numbers" in refusal(write(tmp_path, [*GOOD[:2], GOOD[2][:20], *GOOD[3:]]))


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


def test_time_that_goes_backwards_is_an_error(tmp_path):
    assert "run.tum, line 4: time goes backwards, from 1403636580.250000000 s to 1403636580.150000000 s" in refusal(
        write(tmp_path, [*GOOD[:2], GOOD[5], *GOOD[3:5]])
    )


def test_nanoseconds_among_seconds_are_an_error(tmp_path):
    odd = "1403636580100000000 2 0 0 0 0 0 1"
    message = refusal(write(tmp_path, [*GOOD[:2], odd, *GOOD[3:]]))
    assert "run.tum, line 3: expected eight numbers" in message
    assert message.endswith("are these nanoseconds, where seconds belong?")
    odd = "1.40363658 2 0 0 0 0 0 1"
    assert "line 3: the stamp leaps from 1403636580.050000000 s to 1.403636580 s" in refusal(
        write(tmp_path, [*GOOD[:2], odd, *GOOD[3:]])
    )


def test_seconds_where_nanoseconds_belong_are_an_error(tmp_path):
    lines = [",".join(line.split()) for line in GOOD]
    assert "are the stamps in another unit" in refusal(write(tmp_path, lines, "data.csv"))


@pytest.mark.parametrize("separator", [",", ";", ", "])
def test_a_wrong_separator_is_an_error(tmp_path, separator):
    path = write(tmp_path, [line.replace(" ", separator) for line in GOOD])
    assert "run.tum, line 1: expected eight numbers" in refusal(path)
    assert "separated by blanks" in refusal(path)
    assert "separated by commas" in refusal(write(tmp_path, GOOD, "data.csv"))


@pytest.mark.parametrize(("quaternion", "length"), [("0 0 0 0", "0"), ("0 0 0 2", "2"), ("1 1 1 1", "2")])
def test_a_quaternion_that_is_not_of_unit_length_is_an_error(tmp_path, quaternion, length):
    path = write(tmp_path, [*GOOD[:3], f"1403636580.15 3 0 0 {quaternion}", *GOOD[4:]])
    assert f"run.tum, line 4: expected a unit quaternion, found one of length {length}" in refusal(path)


def test_rounded_quaternions_are_normalised(tmp_path):
    read = read_trajectory_file(str(write(tmp_path, ["0 0 0 0 0.5001 0.5 0.5 0.5", "1 0 0 0 0 0 0 0.9999"])))
    np.testing.assert_allclose(np.linalg.norm(read.trajectory.quaternions, axis=1), 1.0, atol=1e-15)


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
