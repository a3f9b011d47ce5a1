"""What goes wrong between us and nodes."""

from __future__ import annotations


class RosError(Exception):
    """A peer refused, is gone, or does not speak as it should."""


class NodeEndedError(Exception):
    """The node's process has ended."""


class RejectedError(RosError):
    """An action's server does not accept a goal."""
