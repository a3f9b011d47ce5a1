"""Window, sampling, lever arm, plane, first poses and origin: against evo, an independent implementation."""

from __future__ import annotations

import numpy as np
import pytest
from evo.core import metrics, sync
from evo.core.trajectory import Plane as EvoPlane
from evo.core.trajectory import PoseTrajectory3D
from scipy.spatial.transform import Rotation

from taskslam.errors import TrajectoryError
from taskslam.evaluation.trajectory_alignment import Alignment, align
from taskslam.evaluation.trajectory_association import associate_trajectories
from taskslam.evaluation.trajectory_errors import absolute_errors
from taskslam.evaluation.trajectory_preparation import Plane, Preparation
from taskslam.geometry import pose_from_xyz_rpy
from taskslam.record.trajectories import SpatialTrajectory

SECOND = 1_000_000_000
ARM = pose_from_xyz_rpy([0.3, -0.1, 0.2], [0.1, 0.2, 0.3])


def drive(seed: int, count: int = 500) -> tuple[SpatialTrajectory, SpatialTrajectory]:
    rng = np.random.default_rng(seed)
    stamps = 1_700_000_000 * SECOND + np.arange(count) * 50_000_000
    positions = np.cumsum(rng.normal(0.02, 0.03, (count, 3)), axis=0)
    turns = Rotation.from_rotvec(np.cumsum(rng.normal(0, 0.02, (count, 3)), axis=0))
    frame = Rotation.random(rng=rng)
    noisy = turns * Rotation.from_rotvec(rng.normal(0, 0.01, (count, 3)))
    estimate = SpatialTrajectory(
        stamps, frame.apply(positions + rng.normal(0, 0.02, (count, 3))) + 3, (frame * noisy).as_quat()
    )
    return SpatialTrajectory(stamps, positions, turns.as_quat()), estimate


def in_evo(trajectory: SpatialTrajectory) -> PoseTrajectory3D:
    quaternions = trajectory.quaternions[:, [3, 0, 1, 2]]
    return PoseTrajectory3D(trajectory.positions, quaternions, trajectory.stamps / SECOND)


def ours(truth, estimate, preparation, kind=Alignment.SE3, first=None):
    matched, run = associate_trajectories(preparation.of_truth(truth), preparation.of_run(estimate))
    aligned = align(run, matched, kind, first).apply(run)
    errors = absolute_errors(preparation.projected(matched), preparation.projected(aligned))
    return errors.translation, errors.rotation


def theirs(reference, estimate, plane=None, origin=False, first=-1):
    reference, estimate = sync.associate_trajectories(reference, estimate)
    estimate.align_origin(reference) if origin else estimate.align(reference, n=first)
    for trajectory in (reference, estimate) if plane else ():
        trajectory.project(plane)
    found = []
    for relation in (metrics.PoseRelation.translation_part, metrics.PoseRelation.rotation_angle_rad):
        ape = metrics.APE(relation)
        ape.process_data((reference, estimate))
        found.append(ape.error)
    return found


def same(mine, evo_s):
    for a, b in zip(mine, evo_s, strict=True):
        assert len(a) == len(b)
        np.testing.assert_allclose(a, b, atol=1e-9)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("first", [3, 50, 500, 9999])
def test_first_poses_alone_align(seed, first):
    truth, estimate = drive(seed)
    same(ours(truth, estimate, Preparation(), first=first), theirs(in_evo(truth), in_evo(estimate), first=first))


@pytest.mark.parametrize("seed", [0, 1])
def test_origins_are_laid_on_one_another(seed):
    truth, estimate = drive(seed)
    same(ours(truth, estimate, Preparation(), Alignment.ORIGIN), theirs(in_evo(truth), in_evo(estimate), origin=True))


@pytest.mark.parametrize("plane", Plane)
@pytest.mark.parametrize("seed", [0, 1])
def test_both_are_projected_into_a_plane(seed, plane):
    truth, estimate = drive(seed)
    evo_s = theirs(in_evo(truth), in_evo(estimate), plane=EvoPlane(plane.value))
    same(ours(truth, estimate, Preparation(plane=plane)), evo_s)


@pytest.mark.parametrize("most", [1000, 400, 57])
def test_evenly_spaced_poses_are_kept(most):
    truth, estimate = drive(2)
    reference, run = in_evo(truth), in_evo(estimate)
    reference.downsample(most)
    run.downsample(most)
    same(ours(truth, estimate, Preparation(most_poses=most)), theirs(reference, run))


def test_a_window_of_time_counts():
    truth, estimate = drive(3)
    reference = in_evo(truth)
    start, end = 1_700_000_002.0, 1_700_000_017.5
    reference.reduce_to_time_range(start, end)
    found = ours(truth, estimate, Preparation(start, end))
    same(found, theirs(reference, in_evo(estimate)))
    assert len(found[0]) == 311
    with pytest.raises(TrajectoryError, match="no pose of the ground truth lies in the window of time; it holds"):
        Preparation(start_s=1_800_000_000.0).of_truth(truth)


def test_a_lever_arm_brings_the_sensor_to_the_body():
    truth, _ = drive(4)
    sensor = SpatialTrajectory.from_matrices(truth.stamps, truth.matrices() @ ARM)
    moved = Preparation(T_body_sensor=ARM).of_run(sensor)
    np.testing.assert_allclose(moved.matrices(), truth.matrices(), atol=1e-12)
    run = in_evo(sensor)
    run.transform(np.linalg.inv(ARM), right_mul=True)
    np.testing.assert_allclose(moved.positions, run.positions_xyz, atol=1e-9)
