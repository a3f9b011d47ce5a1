import pytest

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
