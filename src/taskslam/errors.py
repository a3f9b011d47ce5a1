"""What can go wrong, one small class per kind. Every message says what, where, and what was expected."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class TaskSlamError(Exception):
    """Root of all errors that the command line turns into one sentence."""

    exit_status = 2


class InputError(TaskSlamError):
    """The user's input (a file, a key, an argument) is wrong."""


class WorldError(InputError):
    """A world, model, mesh or texture cannot be used."""


class WholeWorldError(WorldError):
    """What is wrong is no part's own, which could be left out: the world is refused."""


class WorldTooLargeError(WholeWorldError):
    """A world comes to more than may be held."""


class LeavesFolderError(WholeWorldError):
    """A world names a file outside the folders that it was given."""


class FloorPlanError(InputError):
    """A floor plan cannot be read or does not fit."""


class ScenarioError(InputError):
    """A scenario is invalid: unknown key, waypoint in a wall, empty sequence."""


class PlannerError(InputError):
    """A local planner is not registered, cannot be built, or breaks its contract."""


class RobotError(InputError):
    """A robot description is invalid."""


class UnknownMethodError(InputError):
    """No SLAM method of that name is registered."""


class MethodUnavailableError(InputError):
    """A SLAM method is known but the package that it needs is not installed."""


class RecordError(InputError):
    """A run directory or journal cannot be read."""


class DatasetError(InputError):
    """A recording (EuRoC folder, bag, MCAP, published trial) cannot be read, or lacks what is asked of it."""


class TrajectoryError(InputError):
    """A trajectory, a recording or a study of several cannot be read or evaluated."""


class CameraError(InputError):
    """A camera's calibration is missing, singular or of another resolution, or images give none."""


class InfrastructureError(TaskSlamError):
    """The benchmark itself failed; never counted against a method (design D6)."""

    exit_status = 3


class HostFailedError(InfrastructureError):
    """The process that hosts a method could not be run at all."""


class DetectorError(InfrastructureError):
    """The tag detector died over an image, or gave no answer."""


class SimulatorFailedError(InfrastructureError):
    """The simulator failed."""


class DiskFullError(InfrastructureError):
    """A result could not be written: the disk is full or the folder is not writable."""


def did_you_mean(wrong: str, known: Iterable[str]) -> str:
    """`" Did you mean 'x'?"` for the closest known name, or an empty string."""
    close = difflib.get_close_matches(wrong, list(known), n=1, cutoff=0.5)
    return f" Did you mean '{close[0]}'?" if close else ""
