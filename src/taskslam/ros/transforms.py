"""Where a robot's frames are: what /tf and /tf_static said last, from a frame up to one above it (REP-105)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from taskslam.datasets import ros_decoding
from taskslam.errors import DatasetError
from taskslam.geometry import FloatArray
from taskslam.skipped import Skipped

_DEEPEST = 100


@dataclass(frozen=True, slots=True)
class _Link:
    parent: str
    T: FloatArray
    heard: int | None  # by the robot's clock; None for one that is said once and for all


class Transforms:
    """The newest transform above every frame. What is no transform is skipped, and counted."""

    def __init__(self) -> None:
        self.skipped = Skipped()
        self._above: dict[str, _Link] = {}

    def take(self, message: Any, now: int | None) -> None:
        """A tf2_msgs/TFMessage. now: ns by the robot's clock, None for /tf_static."""
        for transform in message.transforms:
            parent, child = transform.header.frame_id.lstrip("/"), transform.child_frame_id.lstrip("/")
            try:
                T = ros_decoding.pose_message(transform.transform)
            except DatasetError as error:
                self.skipped.add(f"transforms {parent} -> {child}", str(error))
                continue
            self._above[child] = _Link(parent, T, now)

    def has(self, world: str) -> bool:
        """Whether any frame is known in that one."""
        return any(link.parent == world.lstrip("/") for link in self._above.values())

    def pose(self, world: str, frame: str) -> tuple[FloatArray, int | None]:
        """(4, 4) of a frame in one above it, and when the oldest part of it was heard.

        Raises DatasetError: the two are not connected.
        """
        T, oldest, at = np.eye(4), None, frame.lstrip("/")
        for _ in range(_DEEPEST):
            if at == world.lstrip("/"):
                return T, oldest
            if (link := self._above.get(at)) is None:
                break
            T, at = link.T @ T, link.parent
            if link.heard is not None:
                oldest = link.heard if oldest is None else min(oldest, link.heard)
        ends = f"'{frame}' hangs below '{at}'" if at != frame else f"'{frame}' hangs below nothing"
        raise DatasetError(f"no transform connects '{world}' and '{frame}': {ends}, and nothing is known above it")
