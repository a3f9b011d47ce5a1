"""Our numbers against those of evo, an independent implementation, on real runs and on synthetic ones."""

import numpy as np
import pytest
from evo.core import metrics, sync
from evo.core.trajectory import PoseTrajectory3D
from evo.core.units import Unit
from evo.tools import file_interface
from scipy.spatial.transform import Rotation

from taskslam.evaluation.trajectory_alignment import Alignment, align
from taskslam.evaluation.trajectory_association import associate_trajectories
from taskslam.evaluation.trajectory_errors import (
    Statistics,
    absolute_errors,
    relative_distance_errors,
    relative_errors,
)
from taskslam.evaluation.trajectory_pairs import DeltaUnit, pairs
from taskslam.record.trajectories import SpatialTrajectory, read_spatial_trajectory, write_trajectory

RELATIONS = {
    "translation": metrics.PoseRelation.translation_part,
    "rotation": metrics.PoseRelation.rotation_angle_rad,
    "rotation_part": metrics.PoseRelation.rotation_part,
    "full": metrics.PoseRelation.full_transformation,
}
UNITS = {DeltaUnit.FRAMES: Unit.frames, DeltaUnit.METRES: Unit.meters, DeltaUnit.DEGREES: Unit.degrees}


def synthetic(folder, seed, count=900):
    """A smooth drive in space and a noisy, turned, stretched estimate of two thirds of it, written as TUM files."""
    rng = np.random.default_rng(seed)
    stamps = 1_403_636_580_000_000_000 + np.arange(count) * 20_000_000
    positions = np.cumsum(rng.normal(0.01, 0.02, (count, 3)), axis=0)
    turns = Rotation.from_rotvec(np.cumsum(rng.normal(0.0, 0.02, (count, 3)), axis=0))
    rows = slice(count // 6, count * 5 // 6)
    frame = Rotation.from_rotvec(rng.normal(size=3))
    noisy = turns * Rotation.from_rotvec(rng.normal(0.0, 0.01, (count, 3)))
    estimate = SpatialTrajectory(
        stamps[rows] + rng.integers(-4_000_000, 4_000_000, count)[rows],
        frame.apply(1.1 * positions + rng.normal(0, 0.03, (count, 3)))[rows] + rng.normal(size=3),
        (frame * noisy).as_quat()[rows],
    )
    write_trajectory(folder / "groundtruth.tum", SpatialTrajectory(stamps, positions, turns.as_quat()))
    write_trajectory(folder / "estimate.tum", estimate)
    return folder / "groundtruth.tum", folder / "estimate.tum"


@pytest.fixture(
    params=["synthetic 0", "synthetic 1", "MH_01/vislam_rp_run0", "MH_03/vislam_ba_run4", "MH_05/vislam_rp_run9"]
)
def files(request, tmp_path):
    kind, _, seed = request.param.partition(" ")
    if kind == "synthetic":
        return synthetic(tmp_path, int(seed))
    data = request.getfixturevalue("data") / "euroc"
    return data / request.param.split("/")[0] / "groundtruth.tum", data / f"{request.param}.tum"


@pytest.fixture
def associated(files):
    """(reference, estimate) of ours and of evo."""
    ours = associate_trajectories(*(read_spatial_trajectory(path) for path in files))
    theirs = sync.associate_trajectories(*(file_interface.read_tum_trajectory_file(path) for path in files))
    return ours, theirs


def test_association(associated):
    ours, theirs = associated
    for mine, other in zip(ours, theirs, strict=True):
        assert len(mine) == other.num_poses > 50
        np.testing.assert_allclose(mine.stamps / 1e9, other.timestamps, rtol=0, atol=1e-6)
        np.testing.assert_allclose(mine.positions, other.positions_xyz, rtol=0, atol=1e-12)


@pytest.mark.parametrize("alignment", [Alignment.NONE, Alignment.SE3, Alignment.SIM3])
def test_absolute_errors(associated, alignment):
    (reference, estimate), (their_reference, their_estimate) = associated
    if alignment is not Alignment.NONE:
        their_estimate.align(their_reference, correct_scale=alignment is Alignment.SIM3)
    errors = absolute_errors(reference, align(estimate, reference, alignment).apply(estimate))
    for name, relation in RELATIONS.items():
        ape = metrics.APE(relation)
        ape.process_data((their_reference, their_estimate))
        np.testing.assert_allclose(getattr(errors, name), ape.error, rtol=0, atol=1e-9)
        for statistic, value in vars(Statistics.of(getattr(errors, name))).items():
            assert value == pytest.approx(ape.get_all_statistics()[statistic], abs=1e-9)


@pytest.mark.parametrize(
    ("delta", "unit", "all_pairs"),
    [
        (1, DeltaUnit.FRAMES, False),
        (7, DeltaUnit.FRAMES, False),
        (7, DeltaUnit.FRAMES, True),
        (0.37, DeltaUnit.METRES, False),
        (0.37, DeltaUnit.METRES, True),
        (11.3, DeltaUnit.DEGREES, False),
    ],
)
def test_relative_errors(associated, delta, unit, all_pairs):
    (reference, estimate), their_pair = associated
    found = pairs(estimate, delta, unit, all_pairs)
    errors = relative_errors(reference, estimate, found)
    for name, relation in RELATIONS.items():
        rpe = metrics.RPE(relation, delta, UNITS[unit], all_pairs=all_pairs)
        rpe.process_data(their_pair)
        assert found.second.tolist() == rpe.delta_ids
        np.testing.assert_allclose(getattr(errors, name), rpe.error, rtol=0, atol=1e-9)
    rpe = metrics.RPE(metrics.PoseRelation.point_distance, delta, UNITS[unit], all_pairs=all_pairs)
    rpe.process_data(their_pair)
    np.testing.assert_allclose(relative_distance_errors(reference, estimate, found), rpe.error, rtol=0, atol=1e-9)


def test_association_of_unequal_rates_takes_a_pose_twice_as_evo_does():
    rng = np.random.default_rng(3)
    for counts in ((40, 90), (90, 40), (60, 60)):
        stamps = [np.unique(rng.integers(0, 2_000, count)) * 1_000_000 for count in counts]
        still = [np.zeros((len(s), 3)) for s in stamps]
        upright = [np.tile([0.0, 0, 0, 1], (len(s), 1)) for s in stamps]
        ours = associate_trajectories(
            *(SpatialTrajectory(*parts) for parts in zip(stamps, still, upright, strict=True)), 10_400_000
        )
        theirs = sync.associate_trajectories(
            *(PoseTrajectory3D(p, q[:, [3, 0, 1, 2]], s / 1e9) for s, p, q in zip(stamps, still, upright, strict=True)),
            max_diff=0.0104,
        )
        for mine, other in zip(ours, theirs, strict=True):
            np.testing.assert_array_equal(mine.stamps, np.round(other.timestamps * 1e9))
