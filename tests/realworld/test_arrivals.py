import contextlib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taskslam.errors import InputError
from taskslam.geometry import SE2
from taskslam.realworld.arrivals import read_arrivals
from taskslam.realworld.measured_run import run_events, write_run
from taskslam.realworld.setup_file import Place, RunSource, Setup
from taskslam.record import Arrival, RoundEnded, RoundStarted, RunEnded, RunWriter

SECOND = 10**9
GOALS = ((1.0, 2.0, 0.0), (3.0, 4.0, 90.0), (3.0, 4.0, -90.0))


def setup(folder: Path, **run: object) -> Setup:
    source = {"method": "karto", "mode": "without-map", **run}
    waypoints = [Place(x=x, y=y, heading=h) for x, y, h in GOALS]
    content = Setup(runs=(RunSource(**source),), waypoints=tuple(waypoints))
    content._folder = folder
    return content


def read(folder: Path, **run: object):
    content = setup(folder, **run)
    return read_arrivals(content.runs[0], content)


def keys(log) -> list[tuple[int, int]]:
    return [(arrival.round, arrival.goal) for arrival in log.arrivals]


PUBLISHED = """# timestamp x y theta
1700000010.500000 1.000000 2.000000 0.000000
1700000020.500000 3.000000 4.000000 -1.570796
1700000100.500000 1.000000 2.000000 0.000000
1700000110.500000 3.000000 4.000000 1.570796
"""


def test_published_logs_are_matched_by_planned_pose_not_by_order(tmp_path):
    (tmp_path / "visited_waypoints.txt").write_text(PUBLISHED)
    log = read(tmp_path, arrivals="visited_waypoints.txt")
    assert keys(log) == [(0, 0), (0, 2), (1, 0), (1, 1)]
    assert log.arrivals[0].stamp == 1_700_000_010_500_000_000
    assert log.rounds == 2


def test_with_map_the_first_loop_primes(tmp_path):
    (tmp_path / "visited_waypoints.txt").write_text(PUBLISHED)
    log = read(tmp_path, arrivals="visited_waypoints.txt", mode="with-map")
    assert [arrival.priming for arrival in log.arrivals] == [True, True, False, False]
    assert log.rounds == 1


def test_the_loop_index_of_the_nav_info_is_believed(tmp_path):
    rows = ["10.0 1 2 0 0 3", "20.0 3 4 1.570796 1 3", "30.0 3 4 1.570796 1 4"]
    (tmp_path / "visited_waypoints_nav_info.txt").write_text("\n".join(rows))
    assert keys(read(tmp_path, arrivals="visited_waypoints_nav_info.txt")) == [(0, 0), (0, 1), (1, 1)]


def test_trials_in_files_of_their_own_are_rounds(tmp_path):
    for trial in (0, 1):
        (tmp_path / f"t{trial}.txt").write_text(f"{1000 * trial + 10}.0 1 2 0\n{1000 * trial + 20}.0 3 4 1.570796\n")
    assert keys(read(tmp_path, arrivals=["t0.txt", "t1.txt"])) == [(0, 0), (0, 1), (1, 0), (1, 1)]


def test_waypoints_come_from_the_planned_ones_beside_the_log(tmp_path):
    (tmp_path / "visited_waypoints.txt").write_text("10.0 5 6 0.5\n")
    (tmp_path / "planned_waypoints.txt").write_text("# x y theta\n9 9 0\n5 6 0.5\n")
    content = setup(tmp_path, arrivals="visited_waypoints.txt").model_copy(update={"waypoints": None})
    log = read_arrivals(content.runs[0], content)
    assert log.goals == (SE2(9, 9, 0), SE2(5, 6, 0.5))
    assert keys(log) == [(0, 1)]


def test_a_csv_counts_rounds_and_waypoints_from_one_and_knows_its_zone(tmp_path):
    rows = ["time,round,waypoint", "2023-11-14T23:13:20.25+01:00,1,3", "1700000001.5,0,1"]
    (tmp_path / "a.csv").write_text("\n".join(rows))
    log = read(tmp_path, arrivals="a.csv")
    assert keys(log) == [(1, 2), (0, 0)]
    assert log.arrivals[0].stamp == 1_700_000_000_250_000_000
    assert [arrival.priming for arrival in log.arrivals] == [False, True]
    assert log.rounds == 1


def test_a_run_measured_from_files_says_what_its_zero_was(tmp_path):
    (tmp_path / "a.txt").write_text(PUBLISHED)
    content = setup(tmp_path, arrivals="a.txt")
    log = read_arrivals(content.runs[0], content)
    write_run(tmp_path / "run", log, run_events(log, {}, content.pause), {}, "map", None, 0, {})
    again = read(tmp_path, arrivals="run")
    assert again.record.manifest.driven_by == "robot"
    assert [arrival.stamp for arrival in again.arrivals] == [arrival.stamp for arrival in log.arrivals]


def test_our_journal_brings_everything_with_it(tmp_path):
    manifest = {
        "scenario_name": "hall",
        "scenario": {"sequence": {"waypoints": [{"x": 1, "y": 2, "theta": 0}]}},
        "scenario_hash": "0",
        "method": "hector",
        "method_card": {},
        "mode": "with-map",
        "seed": 0,
        "rounds": 1,
        "latency": "fixed",
        "started_utc": "2023-11-14T22:13:20+00:00",
        "wall_s": 1,
        "simulated_s": 1,
        "complete": True,
    }
    at = SE2(1, 2, 0)
    with RunWriter(tmp_path / "run") as run:
        for number in (0, 1):
            t = number * 100 * SECOND
            run.event(RoundStarted(t, number, priming=number == 0))
            run.event(Arrival(t + 10 * SECOND, number, 0, at, at, at, None))
            run.event(RoundEnded(t + 10 * SECOND, number, "reached", 0, 0))
        run.event(RunEnded(110 * SECOND, complete=True))
        run.finish(manifest)
    log = read(tmp_path, arrivals="run", method=None, mode=None)
    assert (log.method, log.mode, log.rounds) == ("hector", "with-map", 1)
    assert log.record.manifest.driven_by == "unknown"  # as run.json of before says nothing of it
    assert [arrival.stamp for arrival in log.arrivals] == [1_700_000_010 * SECOND, 1_700_000_110 * SECOND]
    assert [arrival.priming for arrival in log.arrivals] == [True, False]
    assert read(tmp_path, arrivals="run", time_zero=5.0).arrivals[0].stamp == 15 * SECOND


@pytest.mark.parametrize(
    ("name", "text", "complaint"),
    [
        ("a.txt", "", "holds no arrival"),
        ("a.txt", "10.0 1 2\n", "line 1: expected finite numbers `timestamp x y theta`"),
        ("a.txt", "10.0 1 2 nan\n", "line 1"),
        ("a.txt", "10.0 1 2 zero\n", "line 1"),
        ("a.txt", "10.0 1 2.5 0\n", "is none of the 3 waypoints"),
        ("a.csv", "", "no column time, round, waypoint"),
        ("a.csv", "time,round\n1,1\n", "no column waypoint"),
        ("a.csv", "time,round,waypoint\n", "holds no arrival"),
        ("a.csv", "time,round,waypoint\n10,1,4\n", "line 2: waypoint 4 in round 1; expected waypoints 1 to 3"),
        ("a.csv", "time,round,waypoint\n10,1,0\n", "expected waypoints 1 to 3"),
        ("a.csv", "time,round,waypoint\n2024-01-01T00:00:00,1,1\n", "names no time zone"),
        ("a.csv", "time,round,waypoint\nnoon,1,1\n", "neither Unix seconds nor ISO 8601"),
        ("a.csv", "time,round,waypoint\n10\n", "line 2"),
        ("a.csv", "time,round,waypoint\n10,1,1\n20,1,1\n", "two arrivals at waypoint 1 in one round"),
        ("a.csv", "\x00\x01", "no column"),
    ],
)
def test_a_damaged_log_is_named_with_its_line(tmp_path, name, text, complaint):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=complaint):
        read(tmp_path, arrivals=name)


def test_what_a_file_cannot_say_must_be_given(tmp_path):
    (tmp_path / "a.txt").write_text("10.0 1 2 0\n")
    with pytest.raises(InputError, match="give `method` and `mode`"):
        read(tmp_path, arrivals="a.txt", method=None)
    with pytest.raises(InputError, match="cannot read the log of arrivals"):
        read(tmp_path, arrivals="none.txt")
    (tmp_path / "b.txt").write_text("10.0 1 2 0\n20.0 1 2 0\n")
    with pytest.raises(InputError, match="2 rounds that count; the setup says 1"):
        read(tmp_path, arrivals="b.txt", rounds=1)


@settings(deadline=None, max_examples=100)
@given(st.binary(max_size=300), st.sampled_from(["a.txt", "a.csv"]))
def test_random_bytes_are_an_input_error_or_a_log(tmp_path_factory, data, name):
    folder = tmp_path_factory.mktemp("fuzz")
    (folder / name).write_bytes(data)
    with contextlib.suppress(InputError):
        assert read(folder, arrivals=name).arrivals
