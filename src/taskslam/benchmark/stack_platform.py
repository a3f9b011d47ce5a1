"""A robot that its own navigation drives: beside what any robot over ROS is, goals, and the pose that its /tf tells."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from taskslam.benchmark.ros_platform import Person, RosPlatform
from taskslam.benchmark.stage import Stage
from taskslam.errors import DatasetError
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, Sensor
from taskslam.observer import Observer
from taskslam.ros import names
from taskslam.ros.connection import Connection
from taskslam.ros.navigation import End, NavigationStack
from taskslam.ros.transforms import Transforms
from taskslam.ros.transport import Heard, Transport

_STALE = 3 * NANOSECONDS  # who localises says where the robot is more often than that, also while it stands
_TF_TOPICS = (names.TF, names.TF_STATIC)


class PoseUnknownError(Exception):
    """/tf does not tell where the robot is. Says why."""


class StackPlatform(RosPlatform):
    """One robot with a navigation of its own. navigation: finds it in the graph."""

    def __init__(
        self,
        stage: Stage,
        connect: Callable[[], Transport],
        navigation: Callable[[Transport], NavigationStack],
        connection: Connection,
        person: Person,
        observer: Observer,
    ) -> None:
        super().__init__(stage, connect, connection, {Sensor.WHEEL_ODOMETRY}, person, observer)
        self._find_navigation = navigation
        self._navigation: NavigationStack | None = None
        self._transforms = Transforms()
        self._driven = False

    def send(self, goal: SE2) -> None:
        """Have the robot driven to a goal in the frame that its navigation plans in. Returns at once."""
        self._driven = True
        self._open_navigation.send(self._connection.stack.map, goal)

    def ended(self) -> End | None:
        """How the last goal ended, None while it is under way."""
        end = self._open_navigation.ended()
        if end is not None:
            self._driven = False
        return end

    def offered(self) -> bool:
        """Whether its navigation takes goals."""
        return self._open_navigation.offered()

    def pose(self) -> SE2:
        """The robot's base in the frame that its navigation plans in. Raises PoseUnknownError."""
        world, base = self._connection.stack.map, self._hearing.frames.base
        with self._told:
            try:
                T, heard = self._transforms.pose(world, base)
            except DatasetError as error:
                raise PoseUnknownError(f"{error}: is your SLAM or localisation running?") from None
            if heard is not None and (age := self._robot_now() - heard) > _STALE:
                raise PoseUnknownError(
                    f"nothing was said of '{base}' in '{world}' on {names.TF} for {age / NANOSECONDS:.1f} s"
                )
        return SE2.from_matrix(T)

    @property
    def _open_navigation(self) -> NavigationStack:
        assert self._navigation is not None
        return self._navigation

    def _subscribe(self) -> Iterator[str]:
        yield from super()._subscribe()
        transport = self._open_transport
        published = transport.published()
        if names.TF not in published:
            yield f"nobody publishes {names.TF}, by which the robot's pose is known"
        elif names.TF_STATIC not in published:
            transport.subscribe(names.TF_STATIC, names.KINDS[names.TF_STATIC], latched=True)
        transport.subscribe(names.TF, names.KINDS[names.TF])
        self._navigation = self._find_navigation(transport)
        for topic, kind in self._navigation.topics.items():
            transport.subscribe(topic, kind)
        stand = self._encoder.twist(0.0, 0.0)
        transport.last_words(self._theirs(names.COMMAND), stand)

    def _missed(self) -> Iterator[str]:
        yield from super()._missed()
        yield from self._transforms.skipped.sentences()

    def _is_ready(self) -> bool:
        with self._told:
            known = self._transforms.has(self._connection.stack.map)
        return known and super()._is_ready() and self.offered()

    def _look(self) -> Iterator[str]:
        yield from super()._look()
        if not self.offered():
            yield f"nobody takes goals on {self._open_navigation.action}"
        try:
            self.pose()
        except PoseUnknownError as error:
            yield str(error)
            yield from (words for words in self._open_transport.complaints if names.TF in words)

    def _take(self, heard: Heard) -> None:
        if heard.topic in _TF_TOPICS:
            self._transforms.take(heard.content, self._robot_now() if heard.topic == names.TF else None)
        if self._navigation is not None and heard.topic in self._navigation.topics:
            self._navigation.take(heard)
        elif heard.topic != names.TF:
            super()._take(heard)

    def _is_under_way(self) -> bool:
        return self._driven or super()._is_under_way()

    def _stand(self) -> None:
        if self._navigation is not None:
            self._navigation.cancel()
        super()._stand()
