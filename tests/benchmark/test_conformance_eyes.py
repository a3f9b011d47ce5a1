"""The papered room is the room of the conformance drive, and the drive shows it in step with its other sensors."""

import numpy as np
import pytest

from taskslam.benchmark.conformance_eyes import conformance_looks, conformance_world
from taskslam.errors import InputError
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, Sensor, StereoImages
from taskslam.robot import load_robot
from taskslam.simulation.sensors.camera import StereoCameraSensor, pinhole_of
from taskslam.slam.conformance.drive import ConformanceDrive
from taskslam.slam.conformance.room import spatial_distances


@pytest.fixture(scope="module")
def rig():
    rig = load_robot("turtlebot2").rig
    return rig.model_copy(update={"stereo": rig.stereo.model_copy(update={"width": 160, "height": 120, "rate": 5.0})})


def test_the_camera_sees_the_room_that_the_lidars_measure(rig):
    camera = StereoCameraSensor(rig.stereo, conformance_world(), seed=0)
    pinhole = pinhole_of(rig.stereo)
    for pose in (SE2(0.0, -1.8, 0.3), SE2(2.0, 1.2, 2.5), SE2(-2.4, 0.9, -1.9)):
        depth = camera.views(pose.matrix())[0].depth()
        rows, columns = np.mgrid[10:110:7, 10:150:7]
        optical = np.stack(
            [
                (columns - pinhole.center[0]) / pinhole.focal,
                (rows - pinhole.center[1]) / pinhole.focal,
                np.ones(rows.shape),
            ],
            axis=-1,
        ).reshape(-1, 3)
        body = np.stack([optical[:, 2], -optical[:, 0], -optical[:, 1]], axis=1)
        T_room_camera = pose.matrix() @ rig.stereo.mount.matrix()
        along = np.linalg.norm(body, axis=1)
        origins = np.broadcast_to(T_room_camera[:3, 3], body.shape)
        distances = spatial_distances(origins, body @ T_room_camera[:3, :3].T / along[:, None])
        seen = depth[rows.ravel(), columns.ravel()] * along
        assert np.median(np.abs(seen - distances)) < 1e-3
        assert (np.abs(seen - distances) < 0.02).mean() > 0.97  # but for pixels on an edge


def test_images_come_in_step_and_the_same_however_the_drive_is_cut(rig):
    drive = ConformanceDrive(rig, sensors={Sensor.STEREO_IMAGES}, looks=conformance_looks(rig, {Sensor.STEREO_IMAGES}))
    images = [m for m in drive.measurements(0, NANOSECONDS) if isinstance(m, StereoImages)]
    assert [m.stamp for m in images] == [0, 200_000_000, 400_000_000, 600_000_000, 800_000_000]
    assert images[0].left.std() > 20  # there is something to see
    assert not any(m for m in drive.measurements(0, NANOSECONDS, scans=False) if isinstance(m, StereoImages))


def test_a_robot_without_a_camera_has_no_eyes(rig):
    with pytest.raises(InputError, match="no stereo_images; it has imu"):
        conformance_looks(rig.model_copy(update={"stereo": None}), {Sensor.STEREO_IMAGES})


def test_a_drive_that_begins_again_shows_the_same(rig):
    """Noise and exposure begin anew, or no method with eyes would repeat itself."""
    drive = ConformanceDrive(rig, sensors={Sensor.STEREO_IMAGES}, looks=conformance_looks(rig, {Sensor.STEREO_IMAGES}))
    first, again = (
        [m.left for m in drive.measurements(0, 2 * NANOSECONDS) if isinstance(m, StereoImages)] for _ in range(2)
    )
    np.testing.assert_array_equal(first, again)
