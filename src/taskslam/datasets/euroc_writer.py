"""Writing an EuRoC/ASL folder that existing tools read, from what the sensors of a robot said.

The body frame is the robot's base, so every T_BS is a mount. Images are PNG, numbers are written by repr: reading gives
back the very same measurements. Of the ground truth, position and orientation are written, no velocities or biases.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TextIO

import numpy as np
import numpy.typing as npt
import yaml

from taskslam.datasets.euroc_folder import CAMERAS, IMU, ROBOT_FILE, TRUTH
from taskslam.datasets.quaternions import planar_quaternion
from taskslam.errors import DatasetError
from taskslam.geometry import OPTICAL_IN_BODY, SE2, FloatArray
from taskslam.measurements import ImuSamples, Measurement, Sensor, StereoImages
from taskslam.robot import Imu, Robot, StereoCamera

EUROC_SENSORS = frozenset({Sensor.STEREO_IMAGES, Sensor.IMU})
_IMU_COLUMNS = (
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]"
)
_TRUTH_COLUMNS = "#timestamp,p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []"


class EurocWriter:
    """Writes `mav0` and robot.yaml into a folder, a measurement at a time."""

    def __init__(self, folder: Path, robot: Robot, sensors: frozenset[Sensor]) -> None:
        """Begin. Raises DatasetError for sensors that the form does not know."""
        if unknown := sorted(sensors - EUROC_SENSORS):
            raise DatasetError(
                f"an EuRoC folder holds stereo images and IMU, not {', '.join(unknown)}; write rosbag1, rosbag2 or mcap"
            )
        self._root = folder / "mav0"
        self._open: dict[str, TextIO] = {}
        self._table(TRUTH, _TRUTH_COLUMNS, {"sensor_type": "pose", **_mounted(np.eye(4))})
        if Sensor.STEREO_IMAGES in sensors and (stereo := robot.rig.stereo):
            for eye, camera in enumerate(CAMERAS):
                self._table(camera, "#timestamp [ns],filename", _camera_keys(stereo, eye))
                (self._root / camera / "data").mkdir()
        if Sensor.IMU in sensors and robot.rig.imu:
            self._table(IMU, _IMU_COLUMNS, _imu_keys(robot.rig.imu))
        (folder / ROBOT_FILE).write_text(yaml.safe_dump(robot.model_dump(mode="json"), sort_keys=False), "utf-8")

    def measurement(self, measurement: Measurement) -> None:
        """Write one measurement."""
        if isinstance(measurement, StereoImages):
            for camera, image in zip(CAMERAS, (measurement.left, measurement.right), strict=True):
                name = f"{measurement.stamp}.png"
                _write_png(self._root / camera / "data" / name, image)
                self._open[camera].write(f"{measurement.stamp},{name}\n")
        elif isinstance(measurement, ImuSamples):
            table = np.hstack([measurement.angular_velocity, measurement.linear_acceleration]).tolist()
            for stamp, values in zip(measurement.stamps.tolist(), table, strict=True):
                self._open[IMU].write(",".join([str(stamp), *map(repr, values)]) + "\n")

    def truth(self, stamp: int, pose: SE2) -> None:
        """Write the true pose of an instant (ns)."""
        z, w = planar_quaternion(pose.theta)
        self._open[TRUTH].write(f"{stamp},{pose.x!r},{pose.y!r},0.0,{w!r},0.0,0.0,{z!r}\n")

    def close(self) -> None:
        """Close all files."""
        for file in self._open.values():
            file.close()

    def _table(self, name: str, columns: str, keys: dict[str, object]) -> None:
        folder = self._root / name
        folder.mkdir(parents=True)
        (folder / "sensor.yaml").write_text(yaml.safe_dump(keys, sort_keys=False, default_flow_style=None), "utf-8")
        self._open[name] = (folder / "data.csv").open("w", encoding="utf-8", newline="\n")
        self._open[name].write(columns + "\n")


def _write_png(path: Path, image: npt.NDArray[np.uint8]) -> None:
    from PIL import Image

    Image.fromarray(image).save(path, format="PNG", compress_level=1)


def _mounted(T_base_sensor: FloatArray) -> dict[str, object]:
    return {"T_BS": {"cols": 4, "rows": 4, "data": [float(value) for value in T_base_sensor.ravel()]}}


def _camera_keys(stereo: StereoCamera, eye: int) -> dict[str, object]:
    beside = np.eye(4)
    beside[1, 3] = -stereo.baseline * eye
    return {
        "sensor_type": "camera",
        "comment": f"rectified, {'left' if eye == 0 else 'right'}",
        **_mounted(stereo.mount.matrix() @ beside @ OPTICAL_IN_BODY),
        "rate_hz": stereo.rate,
        "resolution": [stereo.width, stereo.height],
        "camera_model": "pinhole",
        "intrinsics": [stereo.focal_length, stereo.focal_length, *stereo.center],
        "distortion_model": "radial-tangential",
        "distortion_coefficients": [0.0, 0.0, 0.0, 0.0],
    }


def _imu_keys(imu: Imu) -> dict[str, object]:
    """Densities from the standard deviation of one sample; the biases keep the values that were drawn: no walk."""
    return {
        "sensor_type": "imu",
        **_mounted(imu.mount.matrix()),
        "rate_hz": imu.rate,
        "gyroscope_noise_density": imu.gyro_noise / math.sqrt(imu.rate),
        "gyroscope_random_walk": 0.0,
        "accelerometer_noise_density": imu.accel_noise / math.sqrt(imu.rate),
        "accelerometer_random_walk": 0.0,
    }
