"""Pure functions from records and arrays to metrics."""

from taskslam.evaluation.evaluate import evaluate_runs, read_runs
from taskslam.evaluation.metrics_file import MetricsFile, RunMetrics, WaypointMetrics, write_metrics
from taskslam.evaluation.run_metrics import run_metrics

__all__ = ["MetricsFile", "RunMetrics", "WaypointMetrics", "evaluate_runs", "read_runs", "run_metrics", "write_metrics"]
