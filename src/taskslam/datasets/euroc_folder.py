"""Reading an EuRoC/ASL folder (Burri et al. 2016): `mav0/cam0`, `cam1`, `imu0`, `state_groundtruth_estimate0`.

The base is the folder's body frame. Distorted cameras are rectified on the way. A `robot.yaml` beside `mav0`, as our
export writes it, gives the rig exactly; else it follows from the sensor.yaml files, and wheel odometry, of which such a
folder has none, is described as the preset turtlebot2's.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from taskslam.datasets.asl_tables import Row, SensorFile, read_rows, read_sensor_file
from taskslam.datasets.dataset import Dataset, TruthPose, order
from taskslam.datasets.distortion import lens
from taskslam.datasets.image_files import read_image
from taskslam.datasets.quaternions import pose_of
from taskslam.datasets.share import Share
from taskslam.datasets.stereo_rectification import (
    CameraCalibration,
    Rectifier,
    mount_of,
    same_camera,
)
from taskslam.errors import DatasetError
from taskslam.measurements import ImuSamples, Measurement, Sensor, StereoImages
from taskslam.reading import is_file, is_folder
from taskslam.robot import Imu, Robot, SensorRig, load_robot
from taskslam.user_files import check, complaint

ROBOT_FILE = "robot.yaml"
CAMERAS = ("cam0", "cam1")
IMU, TRUTH = "imu0", "state_groundtruth_estimate0"
TRUTHS = (TRUTH, "mocap0", "vicon0")  # EuRoC, TUM-VI, EuRoC without an estimate


def is_euroc(path: Path) -> bool:
    """Whether a folder is, or holds, a `mav0`."""
    return is_folder(path / "mav0") or (path.name == "mav0" and is_folder(path))


class EurocFolder(Dataset):
    """One recording in the ASL form."""

    kind = "euroc"

    def __init__(self, path: Path, robot: Robot | None = None) -> None:
        """Read the calibration; measurements are read when they are asked for.

        robot: instead of the folder's own robot.yaml. Raises DatasetError, RobotError.
        """
        super().__init__(path)
        self._root = path if path.name == "mav0" else path / "mav0"
        self.name = self._root.resolve().parent.name
        own = self._root.parent / ROBOT_FILE
        if robot is None and is_file(own):
            robot = load_robot(own)
        stereo = all(is_file(self._root / camera / "data.csv") for camera in CAMERAS)
        inertial = is_file(self._root / IMU / "data.csv")
        self.sensors = frozenset([Sensor.STEREO_IMAGES] * stereo + [Sensor.IMU] * inertial)
        base = robot if robot is not None else load_robot("turtlebot2")
        self._rectifier = self._read_cameras() if stereo else None
        camera = self._rectifier.camera if self._rectifier else None
        if camera is not None and robot is not None and robot.rig.stereo is not None:
            camera = robot.rig.stereo if same_camera(camera, robot.rig.stereo) else camera
        imu = robot.rig.imu if robot is not None else None
        if inertial and imu is None:
            imu = self._read_imu()
        self.rig = SensorRig(odometry=base.rig.odometry, stereo=camera, imu=imu if inertial else None)

    def measurements(self, sensors: Collection[Sensor]) -> Iterator[Measurement]:
        """Images and inertial samples; see `Dataset`."""
        streams: list[Iterator[Measurement]] = []
        if Sensor.IMU in sensors and Sensor.IMU in self.sensors:
            streams.append(self._inertial())
        if Sensor.STEREO_IMAGES in sensors and Sensor.STEREO_IMAGES in self.sensors:
            streams.append(self._pairs())
        return heapq.merge(*streams, key=order)

    def truth(self) -> Iterator[TruthPose]:
        """Rows of state_groundtruth_estimate0 (TUM-VI: mocap0): position and orientation (w x y z) of the body."""
        path = next((place for name in TRUTHS if is_file(place := self._root / name / "data.csv")), None)
        if path is None:
            return
        share = Share(self.skipped, "rows of the ground truth that cannot be read")
        for row in read_rows(path, share):
            T = None
            with share.of(""):
                x, y, z, qw, qx, qy, qz = row.numbers(7)
                T = pose_of((x, y, z), (qx, qy, qz, qw))
                if T is None:
                    raise DatasetError(f"{row.where}: the orientation is not a unit quaternion w x y z")
            if T is not None:
                yield TruthPose(row.stamp, T)
        share.end()

    def _inertial(self) -> Iterator[Measurement]:
        share = Share(self.skipped, "inertial samples that cannot be read")
        for row in read_rows(self._root / IMU / "data.csv", share):
            with share.of(""):
                values = np.array([row.numbers(6)])
            if not share.failed:
                stamps = np.array([row.stamp], np.int64)
                yield ImuSamples(row.stamp, stamps, values[:, :3].copy(), values[:, 3:].copy())
        share.end()

    def _pairs(self) -> Iterator[Measurement]:
        """Pairs with equal stamps; an image without its partner, or one that is damaged, is skipped and counted."""
        assert self._rectifier is not None
        share = Share(self.skipped, "pairs of images that cannot be read")
        rows = [read_rows(self._root / camera / "data.csv", share) for camera in CAMERAS]
        left, right = (next(stream, None) for stream in rows)
        while left is not None and right is not None:
            if left.stamp == right.stamp:
                with share.of(""):
                    images = self._image(left, CAMERAS[0]), self._image(right, CAMERAS[1])
                if not share.failed:
                    yield StereoImages(left.stamp, *self._rectifier(*images))
                left, right = (next(stream, None) for stream in rows)
            else:
                self.skipped.add("images without a partner")
                if left.stamp < right.stamp:
                    left = next(rows[0], None)
                else:
                    right = next(rows[1], None)
        share.end()

    def _image(self, row: Row, camera: str) -> npt.NDArray[np.uint8]:
        assert self._rectifier is not None
        image = read_image(self._image_path(row, camera), row.where, self._size)
        if (image.ndim == 3) != self._rectifier.camera.color:
            raise DatasetError(f"{row.where}: grey and colour images are mixed; expected one kind")
        return image

    def _image_path(self, row: Row, camera: str) -> Path:
        """The image that a row names; never one outside the camera's data folder."""
        if not row.cells:
            raise DatasetError(f"{row.where}: expected a stamp and the name of an image")
        folder = (self._root / camera / "data").resolve()
        try:
            path = (folder / row.cells[0]).resolve()
        except (OSError, ValueError) as error:
            raise DatasetError(f"{row.where}: '{row.cells[0][:100]}' is not the name of a file") from error
        if not path.is_relative_to(folder) or path == folder:
            raise DatasetError(f"{row.where}: '{row.cells[0][:100]}' is not a file inside {folder}")
        if not is_file(path):
            raise DatasetError(f"{row.where}: the image {path} does not exist")
        return path

    def _read_cameras(self) -> Rectifier:
        files = [read_sensor_file(self._root / camera / "sensor.yaml") for camera in CAMERAS]
        cameras = [_calibration(file) for file in files]
        self._size = cameras[0].width, cameras[0].height
        first = next(read_rows(self._root / CAMERAS[0] / "data.csv"), None)
        if first is None:
            raise DatasetError(f"{self._root / CAMERAS[0] / 'data.csv'}: names no image")
        image = read_image(self._image_path(first, CAMERAS[0]), first.where, self._size)
        try:
            return Rectifier(cameras[0], cameras[1], files[0].number("rate_hz"), image.ndim == 3)
        except (DatasetError, ValidationError) as error:
            why = complaint(error) if isinstance(error, ValidationError) else error
            raise DatasetError(f"{self._root}: {why}") from error

    def _read_imu(self) -> Imu:
        """From densities to the standard deviation of one sample."""
        file = read_sensor_file(self._root / IMU / "sensor.yaml")
        rate = file.number("rate_hz")
        if rate <= 0:
            raise DatasetError(f"{file.path}: rate_hz: expected a positive number")
        sheet = {
            "mount": mount_of(file.mount()),
            "rate": rate,
            "gyro_noise": file.number("gyroscope_noise_density") * math.sqrt(rate),
            "accel_noise": file.number("accelerometer_noise_density") * math.sqrt(rate),
        }
        return check(Imu, sheet, str(file.path), DatasetError)


def _calibration(file: SensorFile) -> CameraCalibration:
    width, height = file.numbers("resolution", (2,))
    if not all(16 <= side <= 8192 and side == int(side) for side in (width, height)):
        raise DatasetError(f"{file.path}: resolution: expected two whole numbers from 16 to 8192")
    fx, fy, cx, cy = file.numbers("intrinsics", (4,))
    if fx <= 0 or fy <= 0:
        raise DatasetError(f"{file.path}: intrinsics: expected positive focal lengths first, found {fx:g} and {fy:g}")
    if file.keys.get("camera_model", "pinhole") != "pinhole":
        raise DatasetError(f"{file.path}: camera_model {file.keys['camera_model']!r}; only pinhole is read")
    if file.number("rate_hz") <= 0:
        raise DatasetError(f"{file.path}: rate_hz: expected a positive number")
    has = file.keys.get("distortion_coefficients") is not None
    given = file.numbers("distortion_coefficients", tuple(range(15))) if has else ()
    model, coefficients = lens(str(file.keys.get("distortion_model") or ""), given, str(file.path))
    return CameraCalibration(int(width), int(height), (fx, fy, cx, cy), model, coefficients, file.mount())
