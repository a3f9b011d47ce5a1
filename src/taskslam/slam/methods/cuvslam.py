"""`cuvslam`: the adapter of dim-odom, which runs NVIDIA's cuVSLAM visual odometry, here on the CPU (`use_gpu` False).

Odometry only: no loop closure, no map, and it never says that it sees nothing; forty black frames give forty poses.
Two instances in one process share a state and differ by a millimetre; alone in its process, a run repeats.
The extra brings NVIDIA's CUDA libraries (1.5 GB), which the package loads even where there is no GPU.

The package is told where the cameras sit, so its pose is that of the base; it belongs to the pair's stamp.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from taskslam.geometry import FloatArray
from taskslam.measurements import Measurement, Sensor, StereoImages
from taskslam.robot import SensorRig, StereoCamera
from taskslam.slam.base import Kind, MapMode, MethodCard, PoseEstimate, SlamMethod, Status
from taskslam.slam.needs import need_stereo
from taskslam.slam.registry import unavailable
from taskslam.slam.start_frame import StartFrame

# Columns: the optical frame's axes (x right, y down, z forward) in the body's (x forward, y left, z up).
_R_BODY_OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
_LUMA = np.array([0.299, 0.587, 0.114])  # ITU-R BT.601
_CAMERAS = ("left", "right")


class Cuvslam(SlamMethod):
    """Stereo visual odometry. No options: the package passes over those that it does not know."""

    card: ClassVar[MethodCard] = MethodCard(
        name="cuvslam",
        version="0.4",
        licence="Apache-2.0 with NVIDIA's libraries",
        kind=Kind.ODOMETRY,
        sensors=(Sensor.STEREO_IMAGES,),
        summary="cuVSLAM on the CPU: stereo odometry. No loop closure; never says that it is lost",
        map_mode=MapMode.CONTINUE,
        deterministic=True,
        latency=0.033,
        queue=1,
        homepage="https://github.com/dimensionalOS/dimSLAM",
        extra="cuvslam",
    )

    def __init__(self) -> None:
        self._odometry: Any = None

    def start(self, rig: SensorRig) -> None:
        """Begin at the origin.

        Raises:
            MethodUnavailableError: dim-odom or a library of NVIDIA's is not installed; names the extra.
            InputError: the robot has no stereo camera.
        """
        camera = need_stereo("cuvslam", rig)
        try:
            import dim_odom
        except ModuleNotFoundError as error:
            raise unavailable(self.card.name, self.card, error) from error
        except ImportError as error:  # a library of the extra's that the loader did not find
            raise unavailable(self.card.name, self.card, ModuleNotFoundError(str(error), name="dim_odom")) from error
        mounts = {name: _transform(T) for name, T in zip(_CAMERAS, camera_mounts(camera), strict=True)}
        mounts["base"] = _transform(np.eye(4))  # asked for with every pair
        self._image_class = dim_odom.ImageFrame
        self._odometry = dim_odom.CuvslamOdometry(
            {
                "camera_mode": "stereo",
                "use_gpu": False,
                "rig_frame_id": "base",
                "output_frame_id": "base",
                "odom_frame_id": "odom",
                "cameras": [{"frame_id": name, "rectified": True} for name in _CAMERAS],
            },
            tf=lambda parent, child: mounts.get(child) if parent == "base" else None,
        )
        f, (cx, cy) = camera.focal_length, camera.center
        intrinsics = [f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0]
        for name in _CAMERAS:
            self._odometry.handle_camera_info(
                dim_odom.CameraModel(0, name, camera.width, camera.height, [0.0] * 5, intrinsics)
            )
        self._frame = StartFrame(np.eye(4))

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """A live pose for every pair that the package answers."""
        if not isinstance(measurement, StereoImages):
            return None
        estimate = None
        for name, image in zip(_CAMERAS, (measurement.left, measurement.right), strict=True):
            grey = image if image.ndim == 2 else np.rint(image @ _LUMA).astype(np.uint8)
            height, width = grey.shape
            frame = self._image_class(measurement.stamp, name, width, height, "mono8", width, grey.tobytes())
            estimate = self._odometry.handle_image(frame) or estimate
        if estimate is None:
            return None
        T_odom_base = np.eye(4)
        from scipy.spatial.transform import Rotation

        T_odom_base[:3, :3] = Rotation.from_quat(estimate.rotation_xyzw).as_matrix()
        T_odom_base[:3, 3] = estimate.translation
        return PoseEstimate(measurement.stamp, self._frame.pose(T_odom_base), Status.TRACKING)


def camera_mounts(camera: StereoCamera) -> tuple[FloatArray, FloatArray]:
    """(4, 4) poses of the left and the right optical frame in the base."""
    left = camera.mount.matrix()
    left[:3, :3] = left[:3, :3] @ _R_BODY_OPTICAL
    right = left.copy()
    right[:3, 3] += left[:3, 0] * camera.baseline
    return left, right


def _transform(T: FloatArray) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Translation and quaternion x, y, z, w."""
    from scipy.spatial.transform import Rotation

    return tuple(T[:3, 3].tolist()), tuple(Rotation.from_matrix(T[:3, :3]).as_quat().tolist())
