"""Which topic is which sensor: by message type, by a name that the user gives, or not at all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from taskslam.datasets.ros_encoding import TRUTH
from taskslam.errors import DatasetError, did_you_mean
from taskslam.sensors import sensor_kinds

TRUTH_ROLE = "truth"
_TRUTH_TYPES = ("nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/TransformStamped")


@dataclass(frozen=True, slots=True)
class _Role:
    """What a topic can be for a replay. types: of its messages; usual: the name that decides between several."""

    types: tuple[str, ...]
    usual: str
    hints: tuple[str, ...] = ()


def _roles() -> dict[str, _Role]:
    """Those of every sensor in the table, and the ground truth."""
    topics = [topic for kind in sensor_kinds() for topic in kind.topics if topic.role]
    sensors = {topic.role: _Role((topic.kind,), topic.name, topic.hints) for topic in topics}
    return sensors | {TRUTH_ROLE: _Role(_TRUTH_TYPES, TRUTH)}


def choose_topics(types: Mapping[str, str], named: Mapping[str, str]) -> tuple[dict[str, str], dict[str, str]]:
    """The topic of every role that has one, and for a role with several candidates a sentence that asks for a name.

    types: message type by topic; named: topic by role, as the user gives it.

    Raises:
        DatasetError: a name for an unknown role, a topic that is not there or of a type that cannot be this.
    """
    roles = _roles()
    for role, topic in named.items():
        if role not in roles:
            known = ", ".join(roles)
            raise DatasetError(f"--topic {role}={topic}: expected one of {known}.{did_you_mean(role, roles)}")
        if topic not in types:
            raise DatasetError(f"--topic {role}={topic}: no such topic; the recording has {', '.join(sorted(types))}")
        if types[topic] not in roles[role].types:
            wanted = " or ".join(roles[role].types)
            raise DatasetError(f"--topic {role}={topic}: it is of the type {types[topic]}; expected {wanted}")
    chosen, unclear = dict(named), {}
    for role, wants in roles.items():
        if role in chosen:
            continue
        candidates = [
            topic
            for topic, kind in sorted(types.items())
            if kind in wants.types and _says_truth(topic) == (role == TRUTH_ROLE) and _hints(topic, wants.hints)
        ]
        if len(candidates) == 1:
            chosen[role] = candidates[0]
        elif wants.usual in candidates:
            chosen[role] = wants.usual
        elif candidates:
            unclear[role] = (
                f"Several topics could be {role}: name one, --topic {role}=TOPIC, of {', '.join(candidates)}"
            )
    return chosen, unclear


def _says_truth(topic: str) -> bool:
    """What says that it is the truth is no sensor, and the truth must say so."""
    name = topic.lower()
    return "ground_truth" in name or "groundtruth" in name


def _hints(topic: str, hints: tuple[str, ...]) -> bool:
    """Whether the name allows a role of such hints; depth is an image too, but never one of the others."""
    name = topic.lower()
    if not hints:
        return True
    return any(hint in name for hint in hints) and ("depth" in name) == ("depth" in hints)
