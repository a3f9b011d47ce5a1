"""A transport by the version of ROS."""

from __future__ import annotations

from taskslam.ros.transport import Transport


def open_transport(ros: int, name: str, master: str | None = None) -> Transport:
    """Take part in a graph as the node `name` (as /taskslam). master: of ROS 1, its URI; None for one of our own.

    Raises InputError: there is no such graph, in words.
    """
    from taskslam.ros.ros1.transport import Ros1

    return Ros1(name, master)
