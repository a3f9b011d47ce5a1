import pytest

from taskslam.evaluation.trajectory_alignment import Alignment
from taskslam.report.figures.open_loop import open_loop_figure
from taskslam.studies.study import StudyUnits
from taskslam.studies.study_results import Beaten, FrameSet, MethodSummary, OpenLoopResults, RunResult, Verdict


def frames(share, precision, accuracy):
    return FrameSet(
        frames=100, share=share, runs=2.0, precision_m=precision, precision_unbiased_m=1.5 * precision,
        accuracy_m=accuracy, precision_rad=precision / 10, accuracy_rad=accuracy / 10, precise=1.0,
    )  # fmt: skip


def result(sequence, method, share):
    errors = {"rmse": 0.1, "mean": 0.1, "median": 0.1, "std": 0.0, "min": 0.1, "max": 0.1}
    run = RunResult(
        file="a.tum",
        poses=80,
        associated=80,
        completeness=0.8,
        time_covered=1.0,
        scale=1.0,
        ate_m=errors,
        rotation_rad=errors,
    )
    return MethodSummary(
        sequence=sequence, method=method, alignment=Alignment.SE3, runs=(run, run), position=None, orientation=None,
        ate_m=None, rotation_rad=None, rpe=(),
        common=frames(share, 0.1, 0.2), shared=frames(0.5, 0.04, 0.2),
    )  # fmt: skip


@pytest.fixture
def results():
    beaten = Beaten(results=0, clearly=0, ratio=None)
    return OpenLoopResults(
        units=StudyUnits(), max_difference_s=0.01, frames={"A": 100}, counted={"A": True},
        results=(result("A", "full", 0.9), result("A", "keyframes", 0.01)),
        verdict=Verdict(compared=0, position=beaten, orientation=beaten),
    )  # fmt: skip


@pytest.mark.parametrize("width", ["column", "page"])
def test_a_marker_for_each_result_hollow_and_corrected_where_frames_are_of_some_runs(results, width):
    figure = open_loop_figure(results, width)
    position = figure.axes[0]
    markers = [line for line in position.lines if line.get_marker() not in ("None", None, "")]
    places = {tuple(round(float(v), 6) for v in (line.get_xdata()[0], line.get_ydata()[0])): line for line in markers}
    assert set(places) == {(20.0, 10.0), (20.0, 6.0)}
    assert places[20.0, 6.0].get_markerfacecolor() == "white"
    assert places[20.0, 10.0].get_markerfacecolor() != "white"
    texts = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert texts.count("A") == 4
    assert {"full", "keyframes", "80", "frames of all runs", "frames of some runs"} <= set(texts)
