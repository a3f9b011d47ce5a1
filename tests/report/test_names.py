from taskslam.record import Manifest
from taskslam.report.names import method_labels, short_names


def run_of(method="karto", mode="without-map", name="house", latency="fixed", options=(), **scenario):
    scenario = {"robot": "turtlebot2", "sequence": {"waypoints": [{"x": 1.0, "y": 0.0, "theta": 0.0}]}, **scenario}
    return Manifest(
        scenario_name=name, scenario=scenario, scenario_hash="", method=method, method_card={},
        method_options=dict(options), mode=mode, seed=0, rounds=2, latency=latency, started_utc="", wall_s=1,
        simulated_s=1, complete=True,
    )  # fmt: skip


def test_a_method_that_was_run_in_one_way_has_its_name_alone():
    assert method_labels([run_of(), run_of(mode="with-map"), run_of("hector", latency="zero")]) == [
        "karto",
        "karto",
        "hector",
    ]


def test_ways_in_which_a_method_was_run_are_in_its_name():
    assert method_labels([run_of(), run_of(planner="dwa")]) == ["karto (teb planner)", "karto (dwa planner)"]
    assert method_labels([run_of(), run_of(options={"b": 2, "a": 1}, latency="zero")]) == [
        "karto (default options, fixed latency)",
        "karto (a = 1, b = 2, zero latency)",
    ]


def test_robots_are_named_where_both_drove_the_same_tour():
    slow = "robots/vga.yaml"
    assert method_labels([run_of(), run_of(name="office", robot=slow)]) == ["karto", "karto"]
    assert method_labels([run_of(), run_of(robot=slow), run_of("hector")]) == [
        "karto (turtlebot2)",
        "karto (vga)",
        "hector",
    ]


def test_a_short_name_stays_and_a_long_one_loses_its_middle():
    assert short_names(["karto", "a_very_long_method"], 9) == ["karto", "a_ver…hod"]


def test_names_that_differ_stay_different():
    names = [f"the same beginning {number:03d} the same end" for number in range(120)]
    short = short_names(names, 8)
    assert len(set(short)) == len(names)
    assert max(map(len, short)) <= 8
