"""The adapters of 3D LiDAR(-inertial) packages: frames, stamps, options, and what they say of an absent package."""

import dataclasses
import subprocess
import sys

import numpy as np
import pytest

from taskslam.errors import InputError, MethodUnavailableError
from taskslam.geometry import is_rigid
from taskslam.measurements import PointCloud, Sensor
from taskslam.robot import SensorRig
from taskslam.slam.methods.evalio_methods import (
    CtIcp,
    Dlio,
    EvalioKissIcp,
    Form,
    GenzIcp,
    LioSam,
    Loam,
    MadIcp,
    organised,
)
from taskslam.slam.methods.kiss_icp import KissIcp
from taskslam.slam.methods.rko_lio import RkoLio
from taskslam.slam.methods.se3_lio import Se3Lio

EVALIO = [Dlio, LioSam, EvalioKissIcp, GenzIcp, MadIcp, CtIcp, Loam, Form]
PACKAGE = {KissIcp: "kiss_icp", RkoLio: "rko_lio", Se3Lio: "se3_lio", **dict.fromkeys(EVALIO, "evalio")}
ALL = list(PACKAGE)


def named(method):
    return method.card.name


def started(kind, rig, **options):
    pytest.importorskip(PACKAGE[kind], reason=f"the extra {kind.card.extra} is not installed")
    method = kind(**options)
    method.start(rig)
    return method


@pytest.mark.parametrize("kind", ALL, ids=named)
def test_poses_are_of_the_base_at_their_stamps(kind, rig, follow):
    """Six seconds: two at rest, then along the ellipse. Point-to-point ICP sticks to its own rings on bare walls."""
    done = follow(started(kind, rig), rig, 6)
    assert len(done.estimates) >= 57
    assert all(is_rigid(e.T_start_base, 1e-3) for e in done.estimates)
    stamps = [e.stamp for e in done.estimates]
    assert stamps == sorted(set(stamps))
    assert done.errors[:15].max() < 0.03
    assert done.errors.max() < (0.4 if kind in (KissIcp, RkoLio, EvalioKissIcp) else 0.25)


@pytest.mark.parametrize(("kind", "newest"), [(Dlio, 1.9), (CtIcp, 1.8), (LioSam, 1.7)])
def test_a_method_that_is_behind_says_which_cloud_its_pose_belongs_to(kind, newest, rig, follow):
    assert follow(started(kind, rig), rig, 2).estimates[-1].stamp == round(newest * 1e9)


@pytest.mark.parametrize("kind", [Dlio, Se3Lio, LioSam, MadIcp, CtIcp], ids=named)
def test_the_good_ones_know_their_stamps_and_mounts_to_a_centimetre_or_two(kind, rig, follow):
    """At 0.3 m/s a stamp that is one period late, or a wrong mount, costs 3 cm or more."""
    done = follow(started(kind, rig), rig, 8)
    assert done.errors.max() < 0.025


@pytest.mark.parametrize("kind", [Dlio, Se3Lio, LioSam, MadIcp, CtIcp, GenzIcp, Loam, Form], ids=named)
def test_the_pose_of_a_rolling_turn_carries_the_stamp_that_it_belongs_to(kind, rig, follow):
    """The turn takes 0.1 s, in which the robot drives 3 cm."""
    rolling = rig.model_copy(update={"lidar_3d": rig.lidar_3d.model_copy(update={"rolling": True})})
    done = follow(started(kind, rolling), rolling, 6)
    assert done.errors.mean() < 0.012


@pytest.mark.parametrize("kind", ALL, ids=named)
def test_an_absent_package_names_its_extra(kind, rig, monkeypatch):
    for module in [m for m in sys.modules if m.partition(".")[0] == PACKAGE[kind]]:
        monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setitem(sys.modules, PACKAGE[kind], None)
    with pytest.raises(MethodUnavailableError, match=rf"taskslam\[{kind.card.extra}\]"):
        kind().start(rig)


@pytest.mark.parametrize("kind", ALL, ids=named)
def test_a_robot_without_the_sensors_is_refused(kind, rig):
    with pytest.raises(InputError, match="needs a 3D LiDAR"):
        kind().start(SensorRig(odometry=rig.odometry, imu=rig.imu))
    if Sensor.IMU in kind.card.sensors:
        pytest.importorskip(PACKAGE[kind], reason=f"the extra {kind.card.extra} is not installed")
        with pytest.raises(InputError, match="needs an IMU"):
            kind().start(SensorRig(odometry=rig.odometry, lidar_3d=rig.lidar_3d))


@pytest.mark.parametrize("kind", [Dlio, Se3Lio], ids=named)
def test_a_misspelt_option_is_named(kind, rig):
    right = {"dlio": "imu_calib_time", "se3_lio": "voxel_map_resolution"}[kind.card.name]
    with pytest.raises(InputError, match=f"Did you mean '{right}'"):
        started(kind, rig, **{right[:-1]: 1.0})


@pytest.mark.parametrize("kind", [KissIcp, RkoLio, Se3Lio, MadIcp, CtIcp], ids=named)
def test_an_empty_cloud_is_lost_and_the_next_one_tracks(kind, rig, follow):
    def blind(measurement):
        if not isinstance(measurement, PointCloud) or measurement.stamp != 1_000_000_000:
            return measurement
        return dataclasses.replace(
            measurement,
            points=np.zeros((0, 3), np.float32),
            ring=np.zeros(0, np.uint16),
            time_offset=np.zeros(0, np.int32),
        )

    done = follow(started(kind, rig), rig, 2, blind)
    statuses = {e.stamp: e.status for e in done.estimates}
    assert statuses[1_000_000_000] == "lost"
    assert done.estimates[-1].status == "tracking"
    stamps = [e.stamp for e in done.estimates]
    assert stamps == sorted(set(stamps))


def test_an_organised_cloud_puts_each_return_into_its_cell(rig):
    lidar = rig.lidar_3d
    points = np.array([[-2.0, -0.01, 0.0], [3.0, 0.0, -0.5], [0.0, 4.0, 1.0]], np.float32)
    offsets = np.array([-300, -200, -100], np.int32)
    cloud = PointCloud(1000, points, np.array([0, 3, 15], np.uint16), offsets)
    packed = organised(cloud, lidar, 600)
    assert packed.shape == (16, 440)
    assert [(packed[r, c]["x"], packed[r, c]["t"]) for r, c in ((0, 0), (3, 220), (15, 330))] == [
        (-2, 100),
        (3, 200),
        (0, 300),
    ]
    assert np.count_nonzero(packed["x"]) == 2
    assert np.count_nonzero(packed["y"]) == 2
    assert (packed["ring"][7] == 7).all()


def test_importing_the_adapters_imports_no_package():
    code = (
        "import sys, taskslam.slam.methods.se3_lio, taskslam.slam.methods.evalio_methods, "
        "taskslam.slam.methods.kiss_icp, taskslam.slam.methods.rko_lio;"
        "print([m for m in sys.modules if m.partition('.')[0] in {'se3_lio', 'evalio', 'kiss_icp', 'rko_lio'}])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
