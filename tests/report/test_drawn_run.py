import numpy as np
import pytest

from taskslam.evaluation.trajectory_errors import absolute_errors, relative_errors
from taskslam.evaluation.trajectory_pairs import DeltaUnit, pairs
from taskslam.record.trajectories import SpatialTrajectory
from taskslam.report.drawn_run import ABSOLUTE, box, drawn_run, ground
from taskslam.studies.study_comparison import AlignedRun

COUNT = 600
STAMPS = np.arange(COUNT) * 50_000_000
STILL = np.tile([0.0, 0, 0, 1], (COUNT, 1))
WAY = np.column_stack([np.arange(COUNT) * 0.05, 0.02 * np.sin(np.arange(COUNT)), 3 * np.cos(np.arange(COUNT) / 60)])
TRUTH = SpatialTrajectory(STAMPS, WAY, STILL)


def run(noise=0.1, rows=slice(None), offset=0.0, seed=0):
    moved = WAY + np.random.default_rng(seed).normal(0, noise, WAY.shape)
    estimate = SpatialTrajectory(STAMPS - round(offset * 1e9), moved, STILL)[rows]
    truth = SpatialTrajectory(STAMPS - round(offset * 1e9), WAY, STILL)[rows]
    return AlignedRun(estimate, estimate, truth, 1.0, len(estimate), f"run{seed}", (), estimate.stamps, offset)


def test_the_view_is_along_the_coordinate_that_is_spanned_least():
    assert ground(TRUTH, level=False).axes == (0, 2, 1)  # a camera's frame: z ahead
    assert ground(TRUTH, level=True).axes == (0, 1, 2)
    assert not ground(TRUTH, level=False).rises
    assert ground(TRUTH, level=True).rises


def test_errors_over_time_are_root_mean_squares_of_the_poses_around():
    own = run()
    (stretch,) = drawn_run("s", "m", own, ground(TRUTH, level=False), []).stretches
    errors = absolute_errors(own.truth, own.aligned).translation
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(np.sqrt(np.mean(stretch.errors**2)), rel=0.02)
    assert len(stretch.times) == 240
    assert stretch.times[-1] == pytest.approx(29.9, abs=0.1)


def test_a_gap_parts_a_run_and_its_clock_is_that_of_the_ground_truth():
    there = np.r_[0:200, 300:COUNT]
    first, second = drawn_run("s", "m", run(rows=there, offset=2.0), ground(TRUTH, level=False), []).stretches
    assert (first.begin_s, first.end_s) == (0.0, pytest.approx(9.95))
    assert (second.begin_s, second.end_s) == (pytest.approx(15.0), pytest.approx(29.95))


def test_a_box_counts_every_run_alike():
    on = ground(TRUTH, level=False)
    small, large = run(0.01), run(1.0, slice(0, 100), seed=1)
    drawn = [drawn_run("s", "m", one, on, [(20, DeltaUnit.FRAMES)]) for one in (small, large)]
    errors = absolute_errors(small.truth, small.aligned).translation
    assert box(drawn[:1], ABSOLUTE, 0) == pytest.approx(np.quantile(errors, (0.05, 0.25, 0.5, 0.75, 0.95)), rel=0.01)
    middle = box(drawn, ABSOLUTE, 0)[2]
    assert errors.max() < middle * 1.2  # as many values above the small errors as among them
    chosen = pairs(small.aligned, 20, DeltaUnit.FRAMES)
    relative = relative_errors(small.truth, small.aligned, chosen).translation
    assert box(drawn[:1], "RPE over 20 frames", 0)[2] == pytest.approx(np.median(relative), rel=0.05)
    assert box(drawn, "RPE over 1 m", 0) is None
