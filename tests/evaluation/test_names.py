"""A method that was run in several ways is called by what differs, and by nothing else."""

from taskslam.evaluation.metrics_file import RunMetrics
from taskslam.evaluation.names import method_labels


def run_of(method="karto", mode="without-map", scenario="house", options=(), **known):
    ways = {"latency": "fixed", "planner": "teb", "robot": "turtlebot2", **known}
    return RunMetrics.model_construct(
        method=method, mode=mode, scenario=scenario, seed=0, method_options=dict(options), **ways
    )


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


def test_what_is_not_known_of_a_run_is_no_way_of_its_own():
    measured = run_of(scenario="lab", planner=None, robot=None, latency=None)
    assert method_labels([run_of(), measured]) == ["karto", "karto"]


def test_robots_are_named_where_both_drove_the_same_tour():
    assert method_labels([run_of(), run_of(scenario="office", robot="vga")]) == ["karto", "karto"]
    assert method_labels([run_of(), run_of(robot="vga"), run_of("hector")]) == [
        "karto (turtlebot2)",
        "karto (vga)",
        "hector",
    ]
