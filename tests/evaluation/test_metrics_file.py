import json

import pytest

from taskslam.errors import RecordError
from taskslam.evaluation import evaluate_runs, write_metrics
from taskslam.evaluation.metrics_file import read_metrics
from taskslam.geometry import SE2


@pytest.mark.parametrize("count", [0, 1, 3])
def test_written_a_run_at_a_time_the_text_is_that_of_the_whole(build, tmp_path, count):
    for name in ('a "runs": []', "b", "c"):
        build(name, goals=1, rounds=2).round(0, {0: SE2(0.1, 0, 0)}).round(1, {0: SE2(-0.1, 0, 0)}).write()
    metrics = evaluate_runs([tmp_path / "results"])
    metrics = metrics.model_copy(update={"runs": metrics.runs[:count]})
    path = write_metrics(tmp_path, metrics)
    assert path.read_text() == metrics.model_dump_json(indent=2) + "\n"
    assert read_metrics(path) == metrics


def test_waypoints_in_another_order_and_numbers_beyond_all_bounds_are_refused(build, tmp_path):
    builder = build("run", goals=2, rounds=2)
    builder.round(0, {0: SE2(0.1, 0, 0), 1: SE2(0.1, 0, 0)}).round(1, {0: SE2(-0.1, 0, 0), 1: SE2(0, 0.1, 0)}).write()
    path = write_metrics(tmp_path, evaluate_runs([tmp_path / "results"]))
    content = json.loads(path.read_text())
    content["runs"][0]["waypoints"].reverse()
    path.write_text(json.dumps(content))
    with pytest.raises(RecordError, match="waypoints: expected those of goal 0, 1 and so on in this order"):
        read_metrics(path)
    content["runs"][0]["waypoints"].reverse()
    for value in ("1e300", "NaN"):
        content["runs"][0]["waypoints"][0]["position"]["precision_m"] = "HERE"
        path.write_text(json.dumps(content).replace('"HERE"', value))
        with pytest.raises(RecordError, match="precision_m"):
            read_metrics(path)
