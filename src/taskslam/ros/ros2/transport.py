"""`Transport` over ROS 2: a node of our own behind a bridge, in a domain of our own or that of a user."""

from __future__ import annotations

import os
import queue
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import Any

from taskslam.errors import InfrastructureError
from taskslam.processes.scratch import Scratch
from taskslam.ros.errors import RosError
from taskslam.ros.qos import LATCHED, Quality
from taskslam.ros.ros2.client import Publication, Ros2
from taskslam.ros.ros2.domain import Domain
from taskslam.ros.transport import Heard, Transport

_COUNTED_S = 0.2  # so long a count of peers is believed: asking costs a round trip


class Ros2Graph(Transport):
    """A node `name` (as /taskslam).

    domain: the number of one that others have, or None for one of our own, on this machine alone. setup: a script of
    the user's ROS, whose Python then runs the bridge.

    Raises InputError: there is no bridge to be had so, or no domain.
    """

    def __init__(self, name: str, domain: int | None, setup: str | None = None) -> None:
        self._scratch = Scratch("ros2") if domain is None else None
        self._domain = Domain(self._scratch.folder) if self._scratch else None
        variables = self._domain.variables if self._domain else {"ROS_DOMAIN_ID": str(domain)}
        told = ("ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE", "FASTDDS_DEFAULT_PROFILES_FILE")
        self.variables = {variable: variables[variable] for variable in told if variable in variables}
        self._publications: dict[str, Publication] = {}
        self._subscriptions: dict[str, int] = {}
        self._counts: dict[int, tuple[float, int]] = {}
        self._inbox: queue.SimpleQueue[tuple[str, str, bytes]] = queue.SimpleQueue()
        self._ros: Ros2 | None = None
        try:
            self._ros = Ros2(name.lstrip("/"), setup, variables)
        except BaseException:
            self.close()
            raise
        self.store, self.complaints = self._ros.store, self._ros.complaints

    def advertise(self, topic: str, kind: str, latched: bool = False) -> None:
        """A topic to publish on, reliable: so everybody can read it. Of a type that this ROS lacks, nothing is said."""
        try:
            self._publications[topic] = self.ros.advertise(topic, kind, LATCHED if latched else Quality())
        except RosError as error:
            self.complaints.append(f"nothing is said on {topic}: {error}")

    def publish(self, topic: str, message: Any) -> None:
        """To everybody who reads the topic."""
        if topic in self._publications:
            with self._asking():
                self._publications[topic].publish(message)

    def readers(self, topic: str) -> int:
        """How many are connected to a topic that we publish, a moment ago."""
        return self._peers(self._publications[topic].number) if topic in self._publications else 0

    def subscribe(self, topic: str, kind: str, latched: bool = False) -> None:
        """Hear a topic from now on, with the quality of service that its publishers offer.

        Of a type that this ROS lacks, nothing is heard.
        """
        with self._asking() as ros:
            offered = [end.quality for end in ros.graph().publishers.get(topic, ())]
        lossy = any(quality.reliability == "best_effort" for quality in offered)
        kept = latched and all(quality.durability == "transient_local" for quality in offered)
        asked = Quality(
            reliability="best_effort" if lossy else "reliable",
            durability="transient_local" if kept else "volatile",
        )

        def take(data: bytes) -> None:
            self._inbox.put((topic, kind, data))

        try:
            self._subscriptions[topic] = ros.subscribe(topic, kind, asked, take)
        except RosError as error:
            self.complaints.append(f"nothing is heard on {topic}: {error}")

    def writers(self, topic: str) -> int:
        """How many we are connected to on a topic that we hear, a moment ago."""
        return self._peers(self._subscriptions[topic]) if topic in self._subscriptions else 0

    def hear(self, longest_s: float) -> Sequence[Heard]:
        """What was said since the last time. Raises InfrastructureError: the bridge is gone."""
        said: list[tuple[str, str, bytes]] = []
        with suppress(queue.Empty):
            said.append(self._inbox.get(timeout=longest_s))
            while True:
                said.append(self._inbox.get_nowait())
        with self._asking() as ros:
            if not said and not ros.alive:
                raise RosError("the bridge to ROS 2 has ended")
        heard = []
        for topic, kind, data in said:
            try:
                heard.append(Heard(topic, "", ros.decode(kind, data)))
            except RosError as error:
                if (words := f"{topic}: somebody says what is {error}") not in self.complaints:
                    self.complaints.append(words)
        return heard

    def published(self) -> Mapping[str, str]:
        """The topics that anybody publishes, as far as they are known here yet, with their types."""
        with self._asking() as ros:
            return {topic: ends[0].type for topic, ends in ros.graph().publishers.items()}

    def last_words(self, topic: str, message: Any) -> None:
        """By the bridge, which outlives us."""
        publication = self._publications[topic]
        with self._asking() as ros:
            ros.last_words(publication.number, ros.store.serialize_cdr(message, publication.kind))

    def close(self) -> None:
        """Leave; our own domain is given back."""
        if self._ros is not None:
            self._ros.close()
        if self._domain is not None:
            self._domain.close()
        if self._scratch is not None:
            self._scratch.close()

    def _peers(self, number: int) -> int:
        at, count = self._counts.get(number, (-_COUNTED_S, 0))
        if (now := time.monotonic()) - at >= _COUNTED_S:
            with self._asking() as ros:
                count = ros.matched(number)
            self._counts[number] = now, count
        return count

    @property
    def ros(self) -> Ros2:
        """The bridge, for what is asked by no topic."""
        assert self._ros is not None
        return self._ros

    @contextmanager
    def _asking(self) -> Iterator[Ros2]:
        try:
            yield self.ros
        except RosError as error:
            raise InfrastructureError(f"ROS 2: {error}") from None


def users_domain() -> int:
    """That of the environment, as for any node."""
    with suppress(ValueError):
        return int(os.environ.get("ROS_DOMAIN_ID", "0"))
    return 0
