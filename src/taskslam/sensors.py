"""The table of sensors: all that differs from one kind to another, a row each. Whoever lists sensors reads it.

Rows say by name what lies in rooms above, as entry points do (`package.module:Class`), so that nobody imports a
renderer to read a card. A package adds a row as an entry point of the group `taskslam.sensors`, named as its sensor: it
is loaded where a robot carries such a sensor, a method asks for it, or all are listed.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint
from typing import Any

from taskslam.errors import InputError, did_you_mean
from taskslam.measurements import (
    ImuSamples,
    LaserScan,
    Measurement,
    PointCloud,
    RgbdImages,
    Sensor,
    StereoImages,
    TruePose,
    WheelOdometry,
)
from taskslam.plugins import registered
from taskslam.robot import SENSOR_GROUP, Imu, Lidar2D, Lidar3D, Odometer, Part, SensorRig, StereoCamera
from taskslam.robot.rgbd import RgbdCamera


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic of a bag. name: where our export writes it; kind: its message type.

    role: what `--topic ROLE=NAME` calls it, empty for what is not read by itself; hints: where the type does not tell,
    the name of a topic of this role holds one of these.
    """

    name: str
    kind: str
    role: str = ""
    hints: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorKind:
    """A row of the table.

    measurement: what it says; words: for people. part, field: its data sheet, and where `SensorRig` holds it; neither
    for what no robot carries. is_frame: whether a measurement keeps a method busy, and may be dropped (design D3);
    else it is a stream. rank: at equal stamps, the lowest comes first. main: a method is shown under that of its
    sensors for which this is highest; 0 for one that is only ever an aid. marker: family of markers on figures.
    device: makes the simulated sensor of a part in its `Surroundings`; empty for odometry, which the simulator counts
    itself. topics, bag: where recordings keep it, and the `BagSensor` that writes and reads it there.
    """

    measurement: type[Measurement]
    words: str
    part: type[Part] | None = None
    field: str = ""
    is_frame: bool = True
    rank: int = 100
    main: int = 2
    marker: str = ""
    device: str = ""
    topics: tuple[Topic, ...] = ()
    bag: str = ""

    @property
    def sensor(self) -> Sensor:
        """Its name on cards."""
        return self.measurement.sensor

    def part_of(self, rig: SensorRig) -> Any:
        """Its part in a rig, or None."""
        return rig.parts().get(self.field)


_IMAGE, _INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"
_OURS = (
    SensorKind(
        measurement=LaserScan,
        words="2D LiDAR",
        part=Lidar2D,
        field="lidar_2d",
        rank=3,
        main=3,
        marker="planar",
        device="taskslam.simulation.sensors.lidar:LaserScanner.fitted",
        topics=(Topic("/scan", "sensor_msgs/msg/LaserScan", "laser_scan"),),
        bag="taskslam.datasets.bag_sensors:Scans",
    ),
    SensorKind(
        measurement=PointCloud,
        words="3D LiDAR",
        part=Lidar3D,
        field="lidar_3d",
        rank=4,
        main=4,
        marker="spatial",
        device="taskslam.simulation.sensors.lidar_3d:SpinningLidar.fitted",
        topics=(Topic("/velodyne_points", "sensor_msgs/msg/PointCloud2", "point_cloud"),),
        bag="taskslam.datasets.bag_sensors:Clouds",
    ),
    SensorKind(
        measurement=StereoImages,
        words="stereo camera",
        part=StereoCamera,
        field="stereo",
        rank=5,
        main=5,
        marker="camera",
        device="taskslam.simulation.sensors.camera:StereoCameraSensor.fitted",
        topics=(
            Topic("/stereo/left/image_rect", _IMAGE, "left", ("left", "infra1", "cam0")),
            Topic("/stereo/left/camera_info", _INFO),
            Topic("/stereo/right/image_rect", _IMAGE, "right", ("right", "infra2", "cam1")),
            Topic("/stereo/right/camera_info", _INFO),
        ),
        bag="taskslam.datasets.bag_cameras:Pairs",
    ),
    SensorKind(
        measurement=RgbdImages,
        words="RGB-D camera",
        part=RgbdCamera,
        field="rgbd",
        rank=6,
        main=6,
        marker="camera",
        device="taskslam.simulation.sensors.rgbd:RgbdCameraSensor.fitted",
        topics=(
            Topic("/camera/color/image_raw", _IMAGE, "color", ("color", "rgb")),
            Topic("/camera/color/camera_info", _INFO),
            Topic("/camera/aligned_depth_to_color/image_raw", _IMAGE, "depth", ("depth",)),
            Topic("/camera/aligned_depth_to_color/camera_info", _INFO),
        ),
        bag="taskslam.datasets.bag_rgbd:ColorAndDepth",
    ),
    SensorKind(
        measurement=ImuSamples,
        words="IMU",
        part=Imu,
        field="imu",
        is_frame=False,
        rank=2,
        main=0,
        device="taskslam.simulation.sensors.imu:InertialSensor.fitted",
        topics=(Topic("/imu", "sensor_msgs/msg/Imu", "imu"),),
        bag="taskslam.datasets.bag_sensors:Inertial",
    ),
    SensorKind(
        measurement=WheelOdometry,
        words="wheel odometry",
        part=Odometer,
        field="odometry",
        is_frame=False,
        rank=1,
        main=1,
        marker="wheels",
        topics=(Topic("/odom", "nav_msgs/msg/Odometry", "wheel_odometry"),),
        bag="taskslam.datasets.bag_sensors:Odometry",
    ),
    SensorKind(measurement=TruePose, words="true pose", is_frame=False, rank=0, main=10, marker="truth"),
)
_OWN = {kind.sensor: kind for kind in _OURS}


def sensor_kinds() -> list[SensorKind]:
    """Every row: ours, then those of other packages by name, but for what cannot be loaded (`taskslam doctor`)."""
    others = (_if_known(name) for name in registered(SENSOR_GROUP) if name not in _OWN)
    return [*_OURS, *(kind for kind in others if kind is not None)]


def sensor_kind(sensor: str) -> SensorKind:
    """The row of a sensor by its name on cards. Raises InputError if nobody registers it, or it cannot be loaded."""
    return _OWN[Sensor(sensor)] if sensor in _OWN else _outside(sensor)


def fitted(rig: SensorRig) -> dict[Sensor, SensorKind]:
    """The sensors that a robot with this rig has. Raises InputError if one of another package cannot be loaded."""
    parts = rig.parts()
    ours = [kind for kind in _OURS if kind.field in parts]
    others = [_outside(name) for name in parts.keys() - {kind.field for kind in ours}]
    return {kind.sensor: kind for kind in (*ours, *sorted(others, key=lambda kind: kind.sensor))}


def cameras(rig: SensorRig) -> dict[Sensor, Part]:
    """The parts of a rig that take images, by what they say."""
    parts = {sensor: kind.part_of(rig) for sensor, kind in fitted(rig).items()}
    return {sensor: part for sensor, part in parts.items() if part.image_bytes()}


def sensor_words(sensor: str) -> str:
    """A sensor for people; one that is not known here by its name."""
    kind = _if_known(sensor)
    return kind.words if kind else sensor


def marker_family(sensor: str) -> str:
    """Of the markers on figures; empty for a sensor that is not known here."""
    kind = _if_known(sensor)
    return kind.marker if kind else ""


def main_of(sensors: Collection[str]) -> str:
    """The sensor that a method with these sees with; empty if they are aids only, or none is known here."""
    kinds = [kind for kind in map(_if_known, sensors) if kind and kind.main]
    return max(kinds, key=lambda kind: kind.main).sensor if kinds else ""


def _if_known(sensor: str) -> SensorKind | None:
    """The row, where there may be none: results may come from elsewhere."""
    try:
        return sensor_kind(sensor)
    except InputError:
        return None


def found_at(place: str) -> Any:
    """What a row names as `package.module:attribute`."""
    return EntryPoint("", place, SENSOR_GROUP).load()


@cache
def _outside(name: str) -> SensorKind:
    points = registered(SENSOR_GROUP)
    if name not in points:
        known = sorted({*_OWN, *points})
        raise InputError(f"sensor '{name}': expected one of {', '.join(known)}.{did_you_mean(name, known)}")
    try:
        kind = points[name].load()
    except Exception as error:
        raise InputError(f"sensor '{name}' ({points[name].value}) cannot be loaded: {error}") from error
    if not isinstance(kind, SensorKind) or kind.sensor != name or kind.field != name or kind.part is None:
        raise InputError(
            f"sensor '{name}' ({points[name].value}): expected a SensorKind with a part, whose measurement and field"
            " bear this name too"
        )
    return kind
