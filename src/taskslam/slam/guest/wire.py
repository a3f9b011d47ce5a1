"""What host and child say to one another: measurements and options as messages (`processes/messages.py`)."""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from taskslam.errors import InputError
from taskslam.geometry import SE2
from taskslam.measurements import Measurement
from taskslam.processes.messages import Arrays, Header, WireError, pack
from taskslam.sensors import sensor_kind


@dataclass(frozen=True)
class _Layout:
    """Which fields of a measurement type are scalars, planar poses and arrays."""

    scalars: tuple[tuple[str, type], ...]
    poses: tuple[str, ...]
    arrays: tuple[tuple[str, np.dtype[Any]], ...]


def _array_scalar(hint: object) -> type | None:
    """The scalar type of `NDArray[scalar]`, which is a plain alias up to numpy 2.4 and a named one from 2.5 on."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is np.ndarray:
        scalar: type = typing.get_args(arguments[1])[0]
        return scalar
    return arguments[0] if getattr(origin, "__name__", "") == "NDArray" else None


def _layout(kind: type) -> _Layout:
    hints = typing.get_type_hints(kind)
    scalars, poses, arrays = [], [], []
    for field in dataclasses.fields(kind):
        hint = hints[field.name]
        if hint in (int, float):
            scalars.append((field.name, hint))
        elif hint is SE2:
            poses.append(field.name)
        elif (scalar := _array_scalar(hint)) is not None:
            arrays.append((field.name, np.dtype(scalar).newbyteorder("<")))
        else:
            raise TypeError(f"{kind.__name__}.{field.name}: {hint} cannot travel to a method")
    return _Layout(tuple(scalars), tuple(poses), tuple(arrays))


@cache
def _known(sensor: str) -> tuple[type[Measurement], _Layout]:
    measurement = sensor_kind(sensor).measurement
    return measurement, _layout(measurement)


def pack_measurement(
    number: int, measurement: Measurement, share: Callable[[Arrays], Mapping[str, object] | None] | None = None
) -> bytes:
    """One measurement as message number `number` of the run.

    share: takes the arrays another way if it can, and returns what the message must then say of them (`shared`).

    Raises:
        WireError: a field has not the type that its dataclass declares.
    """
    _, layout = _known(measurement.sensor)
    values: dict[str, object] = {}
    for name, scalar in layout.scalars:
        values[name] = scalar(getattr(measurement, name))
    for name in layout.poses:
        pose: SE2 = getattr(measurement, name)
        values[name] = (float(pose.x), float(pose.y), float(pose.theta))
    arrays: Arrays = {}
    for name, dtype in layout.arrays:
        array = getattr(measurement, name)
        if array.dtype != dtype:
            raise WireError(f"{type(measurement).__name__}.{name} has dtype {array.dtype}; expected {dtype}")
        arrays[name] = array
    header: Header = {"feed": measurement.sensor, "number": number, "values": values}
    shared = share(arrays) if share is not None and arrays else None
    return pack(header, arrays) if shared is None else pack({**header, "shared": shared})


def unpack_measurement(header: Header, arrays: Arrays) -> tuple[int, Measurement]:
    """The inverse of `pack_measurement`: the message's number and the measurement.

    Raises:
        WireError: a field is missing, unknown or of the wrong type.
    """
    try:
        kind, layout = _known(header["feed"])
        values = header["values"]
        fields: dict[str, Any] = {}
        for name, scalar in layout.scalars:
            value = values[name]
            if type(value) is not scalar:
                raise TypeError(f"{name} is {value!r}, expected {scalar.__name__}")
            fields[name] = value
        for name in layout.poses:
            x, y, theta = values[name]
            fields[name] = SE2(x, y, theta)
        for name, dtype in layout.arrays:
            if arrays[name].dtype != dtype:
                raise TypeError(f"{name} has dtype {arrays[name].dtype}, expected {dtype}")
            fields[name] = arrays[name]
        return header["number"], kind(**fields)
    except (KeyError, TypeError, ValueError, InputError) as error:
        raise WireError(f"not a measurement: {error}") from error


def option_values(options: Mapping[str, object]) -> dict[str, object]:
    """Method options as JSON can carry them.

    Raises:
        TypeError: a value is not a string, number, boolean, None, or a list or mapping of those.
    """

    def plain(value: object) -> object:
        if value is None or isinstance(value, (bool, int, float, str)):
            return value
        if isinstance(value, Mapping):
            return {str(key): plain(item) for key, item in value.items()}
        if isinstance(value, Sequence):
            return [plain(item) for item in value]
        raise TypeError(f"{value!r} is a {type(value).__name__}")

    return {str(key): plain(value) for key, value in options.items()}
