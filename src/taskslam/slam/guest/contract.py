"""What the host demands of a method: a valid card, needs that the robot can meet, estimates that are poses."""

from __future__ import annotations

import typing
from typing import Any

import numpy as np

from taskslam.errors import InputError
from taskslam.geometry import is_rigid
from taskslam.measurements import Sensor
from taskslam.printable import printable
from taskslam.processes import messages
from taskslam.robot import SensorRig
from taskslam.sensors import fitted, sensor_kind
from taskslam.slam.base import Kind, MapMode, MethodCard, PoseEstimate, Status

_LONGEST_LATENCY_S = 60.0
_LONGEST_STILL_START_S = 600.0
_LONGEST_QUEUE = 10_000
_LONGEST_TEXT = 1000
_FARTHEST_M = 1e5  # of a pose from its start: what a diverging filter says lies soon beyond
_LARGEST_COVARIANCE = 1e12
_RIGID_TOLERANCE = 1e-3  # methods that compute in float32 still pass


def read_card(method: str, answer: messages.Header) -> MethodCard:
    """Read the card as the child sent it.

    Raises:
        InputError: a field is missing, not of its kind or out of range.
    """
    try:
        fields = dict(answer["card"])
        for field in ("sensors", "optional_sensors"):
            fields[field] = tuple(sensor_kind(sensor).sensor for sensor in fields.get(field, ()))
        fields["kind"], fields["map_mode"] = Kind(fields["kind"]), MapMode(fields["map_mode"])
        fields["reads"] = tuple(fields.get("reads", ()))
        card = MethodCard(**fields)
        _check_types(card)
        if not (
            0 <= (card.latency or 0.0) < _LONGEST_LATENCY_S
            and 1 <= card.queue <= _LONGEST_QUEUE
            and 0 <= card.needs_still_start <= _LONGEST_STILL_START_S
        ):
            raise ValueError(
                f"latency {card.latency!r:.40} s, queue {card.queue!r:.40}, still start {card.needs_still_start!r:.40}"
                f" s; expected 0 to {_LONGEST_LATENCY_S:g} s, 1 to {_LONGEST_QUEUE}, 0 to {_LONGEST_STILL_START_S:g} s"
            )
        return card
    except (KeyError, TypeError, ValueError, OverflowError, RecursionError, InputError) as error:
        raise InputError(f"method '{method}': its card is not valid: {printable(str(error), _LONGEST_TEXT)}") from error


def _check_types(card: MethodCard) -> None:
    for name, kind in typing.get_type_hints(MethodCard).items():
        value = getattr(card, name)
        if kind in (str, bool, int) and type(value) is not kind:
            raise TypeError(f"{name} is {value!r:.80}; expected {kind.__name__}")
        if kind is float and type(value) not in (int, float):
            raise TypeError(f"{name} is {value!r:.80}; expected a number")
        if isinstance(value, str) and len(value) > _LONGEST_TEXT:
            raise ValueError(f"{name} has {len(value)} characters; expected at most {_LONGEST_TEXT}")
    if not all(isinstance(place, str) for place in card.reads) or not isinstance(card.extra, str | None):
        raise TypeError("reads or extra; expected a list of paths, and a name or nothing")


def read_estimate(fields: Any, arrays: messages.Arrays) -> PoseEstimate:
    """Put an estimate together as the child sent it; its numbers are not judged yet.

    Raises:
        WireError: a part is missing or unknown.
    """
    try:
        estimate = PoseEstimate(
            fields["stamp"], arrays["T_start_base"], Status(fields["status"]), arrays.get("covariance")
        )
    except (KeyError, TypeError, ValueError) as error:
        raise messages.WireError(f"an estimate without its parts: {error}") from error
    for array in (estimate.T_start_base, estimate.covariance):
        if array is not None and array.dtype != np.float64:
            raise messages.WireError(f"an estimate of numbers of type {array.dtype}; expected float64")
    return estimate


def what_is_wrong(estimate: PoseEstimate, now: int, last: int) -> str:
    """Say why an estimate made at `now` after one stamped `last` (ns) is not a usable pose; empty if it is."""
    T, covariance = estimate.T_start_base, estimate.covariance
    if not is_rigid(T, _RIGID_TOLERANCE):
        return f"a pose that is not {'a rigid transform' if np.isfinite(T).all() else 'finite'}"
    if np.abs(T[:3, 3]).max() > _FARTHEST_M:
        return f"a pose more than {_FARTHEST_M / 1000:g} km from its start"
    if covariance is not None and (
        covariance.shape != (3, 3)
        or not np.isfinite(covariance).all()
        or np.abs(covariance).max() > _LARGEST_COVARIANCE
    ):
        return "a covariance that is not a 3x3 matrix of finite, bounded numbers"
    if type(estimate.stamp) is not int or estimate.stamp < last:
        return f"a pose that goes back in time (stamp {estimate.stamp} ns after {last} ns)"
    if estimate.stamp > now:
        return f"a pose of the future (stamp {estimate.stamp} ns)"
    return ""


def check_needs(card: MethodCard, rig: SensorRig) -> None:
    """Refuse a method that a robot with this rig cannot run, or that asks for what it may not have.

    Raises:
        InputError: a sensor that the rig has not, wheel odometry used but not asked for, or the truth asked for by a
            method that is not a reference.
    """
    asked = {*card.sensors, *card.optional_sensors}
    if Sensor.TRUE_POSE in asked and card.kind is not Kind.REFERENCE:
        raise InputError(
            f"method '{card.name}' of kind {card.kind} asks for true poses; only methods of kind reference get them"
        )
    if card.odometry_prior and Sensor.WHEEL_ODOMETRY not in asked:
        raise InputError(f"method '{card.name}' uses an odometry prior but has no wheel_odometry among its sensors")
    if not card.sensors:
        raise InputError(f"method '{card.name}' asks for no sensor")
    has = fitted(rig)
    if missing := [sensor for sensor in card.sensors if sensor not in has and sensor != Sensor.TRUE_POSE]:
        raise InputError(
            f"method '{card.name}' needs {', '.join(missing)}, which the robot has not (it has "
            f"{', '.join(sorted(has))})"
        )
