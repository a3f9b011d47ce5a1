"""`Transport`: how we take part in somebody's ROS graph, whatever its version. Who serves or drives a robot knows this.

Topics are whole names; types are written as `sensor_msgs/msg/LaserScan`; messages are those of the transport's `store`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from rosbags.typesys.store import Typestore


@dataclass(frozen=True, slots=True)
class Heard:
    """A message. by: the name of the node that said it, empty where that is not known."""

    topic: str
    by: str
    content: Any


class SlowReaderError(Exception):
    """Who reads a topic of ours has read nothing for long; it is not told anything any more. Says who."""


class Transport(Protocol):
    """One node of ours in a graph. `publish` may be called from any thread, `hear` from one.

    store: the message types; variables: of the environment, by which others find the graph; complaints: what did not
    fit, a sentence each.
    """

    store: Typestore
    variables: Mapping[str, str]
    complaints: list[str]

    def advertise(self, topic: str, kind: str, latched: bool = False) -> None:
        """A topic to publish on. latched: who comes later is told the last message."""

    def publish(self, topic: str, message: Any) -> None:
        """To everybody who reads the topic. Raises SlowReaderError once everybody else has been told."""

    def readers(self, topic: str) -> int:
        """How many are connected to a topic that we publish."""

    def subscribe(self, topic: str, kind: str, latched: bool = False) -> None:
        """Hear a topic from now on; with `latched` also what was said last."""

    def writers(self, topic: str) -> int:
        """How many we are connected to on a topic that we hear."""

    def hear(self, longest_s: float) -> Sequence[Heard]:
        """What was said since the last time, waiting at most so long for the first of it."""

    def published(self) -> Mapping[str, str]:
        """The topics that anybody publishes, ours too, with their types."""

    def last_words(self, topic: str, message: Any) -> None:
        """What is said on a topic of ours if we are killed, as far as this ROS allows it."""

    def close(self) -> None:
        """Leave. Idempotent."""
