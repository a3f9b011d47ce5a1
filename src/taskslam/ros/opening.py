"""Taking part in a graph by the version of ROS. What a version needs is imported when it is asked for."""

from __future__ import annotations

import os

from taskslam.errors import InputError
from taskslam.ros.connection import StackFile
from taskslam.ros.navigation import NavigationStack
from taskslam.ros.transport import Transport


def open_graph_of_our_own(ros: int, name: str, setup: str | None = None) -> Transport:
    """A graph that begins with us, as the node `name` (as /taskslam): its `address` says how others come in.

    setup: a script of the user's ROS 2, whose Python then runs the bridge. Raises InputError.
    """
    if ros == 1:
        from taskslam.ros.ros1.transport import Ros1

        return Ros1(name, None)
    from taskslam.ros.ros2.transport import Ros2Graph

    return Ros2Graph(name, None, setup)


def join_graph(ros: int, name: str, where: str = "", setup: str | None = None) -> Transport:
    """Somebody's graph. where: the master's URI (ROS_MASTER_URI) or the domain's number (ROS_DOMAIN_ID).

    Raises InputError: there is no such graph, in words.
    """
    if ros == 1:
        from taskslam.ros.ros1.transport import Ros1

        if not (master := where or os.environ.get("ROS_MASTER_URI", "")):
            raise InputError("which ROS master? Expected its URI, or ROS_MASTER_URI in the environment")
        return Ros1(name, master)
    from taskslam.ros.ros2.transport import Ros2Graph, users_domain

    try:
        domain = int(where) if where else users_domain()
    except ValueError:
        raise InputError(f"the domain of ROS 2 is '{where}'; expected its number") from None
    return Ros2Graph(name, domain, setup)


def navigation_in(transport: Transport, described: StackFile) -> NavigationStack:
    """The navigation stack in a graph: Nav2 in ROS 2, move_base in ROS 1."""
    from taskslam.ros.ros1.transport import Ros1

    if isinstance(transport, Ros1):
        from taskslam.ros.ros1.move_base import MoveBase

        return MoveBase(transport, described.action or "/move_base")
    from taskslam.ros.ros2.navigate_to_pose import NavigateToPose
    from taskslam.ros.ros2.transport import Ros2Graph

    assert isinstance(transport, Ros2Graph)
    return NavigateToPose(transport.ros, described.action or "/navigate_to_pose", described.behavior_tree)
