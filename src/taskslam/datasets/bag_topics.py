"""Which topic is which sensor: by message type, by a name that the user gives, or not at all."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum

from taskslam.datasets import ros_encoding
from taskslam.errors import DatasetError, did_you_mean


class Role(StrEnum):
    """What a topic can be for a replay."""

    LASER_SCAN = "laser_scan"
    POINT_CLOUD = "point_cloud"
    IMU = "imu"
    WHEEL_ODOMETRY = "wheel_odometry"
    LEFT = "left"
    RIGHT = "right"
    TRUTH = "truth"


_TYPES: dict[Role, tuple[str, ...]] = {
    Role.LASER_SCAN: ("sensor_msgs/msg/LaserScan",),
    Role.POINT_CLOUD: ("sensor_msgs/msg/PointCloud2",),
    Role.IMU: ("sensor_msgs/msg/Imu",),
    Role.WHEEL_ODOMETRY: ("nav_msgs/msg/Odometry",),
    Role.LEFT: ("sensor_msgs/msg/Image",),
    Role.RIGHT: ("sensor_msgs/msg/Image",),
    Role.TRUTH: ("nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/TransformStamped"),
}
_USUAL = {Role.LASER_SCAN: "/scan", Role.WHEEL_ODOMETRY: "/odom", Role.IMU: "/imu", Role.TRUTH: ros_encoding.TRUTH}
_SIDES = {Role.LEFT: ("left", "infra1", "cam0"), Role.RIGHT: ("right", "infra2", "cam1")}


def choose_topics(types: Mapping[str, str], named: Mapping[str, str]) -> tuple[dict[Role, str], dict[Role, str]]:
    """The topic of every role that has one, and for a role with several candidates a sentence that asks for a name.

    types: message type by topic; named: topic by role, as the user gives it.

    Raises:
        DatasetError: a name for an unknown role, a topic that is not there or of a type that cannot be this.
    """
    for role, topic in named.items():
        if role not in list(Role):
            raise DatasetError(f"--topic {role}={topic}: expected one of {', '.join(Role)}.{did_you_mean(role, Role)}")
        if topic not in types:
            raise DatasetError(f"--topic {role}={topic}: no such topic; the recording has {', '.join(sorted(types))}")
        if types[topic] not in _TYPES[Role(role)]:
            wanted = " or ".join(_TYPES[Role(role)])
            raise DatasetError(f"--topic {role}={topic}: it is of the type {types[topic]}; expected {wanted}")
    chosen, unclear = {Role(role): topic for role, topic in named.items()}, {}
    for role in Role:
        if role in chosen:
            continue
        candidates = [t for t, kind in sorted(types.items()) if kind in _TYPES[role] and _may_be(t, role)]
        if len(candidates) == 1:
            chosen[role] = candidates[0]
        elif _USUAL.get(role) in candidates:
            chosen[role] = _USUAL[role]
        elif candidates:
            unclear[role] = (
                f"Several topics could be {role}: name one, --topic {role}=TOPIC, of {', '.join(candidates)}"
            )
    return chosen, unclear


def _may_be(topic: str, role: Role) -> bool:
    """Whether the name allows this role: what says that it is the truth is no sensor, and the truth must say so."""
    name = topic.lower()
    true = "ground_truth" in name or "groundtruth" in name
    if role is Role.TRUTH or true:
        return true and role is Role.TRUTH
    return role not in _SIDES or ("depth" not in name and any(side in name for side in _SIDES[role]))
