"""The method's own process: this module, run with arguments REQUEST_FD REPLY_FD [IMAGES_FD SLOT_SIZE].

Started by `host.py` through `processes/guest.py`, and confined before this module is loaded. It reads messages
(`wire.py`) from one pipe, images from shared memory (`shared_images.py`), feeds them to the method and answers on
another pipe. A method with threads of its own is paced (`pacing.py`). Standard output and error belong to the method
and end in its log. Nothing else is inherited: no journal, no simulator, no true pose.
"""

from __future__ import annotations

import dataclasses
import faulthandler
import inspect
import os
import sys
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from taskslam.errors import InputError, MethodUnavailableError, UnknownMethodError, did_you_mean
from taskslam.processes import messages
from taskslam.processes.guest import SINGLE_THREADED
from taskslam.robot import SensorRig
from taskslam.sensors import cameras, sensor_kind
from taskslam.slam import registry
from taskslam.slam.base import InvalidOutputError, PoseEstimate, SlamMethod, StalledError, Status
from taskslam.slam.guest import wire
from taskslam.slam.guest.loading import load_method
from taskslam.slam.guest.pacing import Pacer
from taskslam.slam.guest.shared_images import ImageWindow

_CHUNK = 1 << 20
_ERRORS = {UnknownMethodError: "unknown", MethodUnavailableError: "unavailable", InputError: "input"}


def construct(method: type[SlamMethod], name: str, options: Mapping[str, object]) -> SlamMethod:
    """An instance with its options as keyword arguments.

    Raises:
        InputError: an option that the method does not take, or a value that it refuses.
    """
    parameters = inspect.signature(method).parameters
    if not any(p.kind is inspect.Parameter.VAR_KEYWORD for p in parameters.values()):
        for key in options:
            if key not in parameters:
                known = ", ".join(sorted(parameters)) or "none"
                hint = did_you_mean(key, parameters)
                raise InputError(f"method '{name}' has no option '{key}' (it takes: {known}).{hint}")
    try:
        return method(**options)
    except (TypeError, ValueError) as error:
        traceback.print_exc()
        raise InputError(f"method '{name}' refuses its options {dict(options)}: {registry.one_line(error)}") from error


class _Child:
    def __init__(self, request: int, reply: int, images: ImageWindow | None) -> None:
        self._request, self._reply = request, reply
        self._images = images
        self._pacer: Pacer | None = None
        self._reader = messages.MessageReader()
        self._out: list[bytes] = []
        self._acknowledge = 0
        self._compute = 0
        self._name = ""
        self._method: SlamMethod | None = None

    def run(self) -> None:
        """Serve until told to stop, or until the host closes the pipe."""
        while chunk := self._receive():
            for header, arrays in self._reader.messages(chunk):
                try:
                    if "feed" in header:
                        self._feed(header, arrays)
                    elif not self._command(header):
                        return
                except InvalidOutputError as error:
                    self._give_up("invalid", str(error), header)
                    return
                except StalledError as error:
                    self._give_up("stalled", str(error), header)
                    return
                except Exception as error:
                    kind = next((kind for cls, kind in _ERRORS.items() if isinstance(error, cls)), "exception")
                    if kind == "exception" or "feed" in header:  # else the sentence says it all
                        traceback.print_exc()
                    detail = str(error) if kind != "exception" else registry.one_line(error)
                    self._give_up(kind, detail, header)
                    return
            self._flush()

    def _receive(self) -> bytes:
        if self._pacer is not None:
            self._pacer.rest(self._request)
        return os.read(self._request, _CHUNK)

    def _feed(self, header: messages.Header, arrays: messages.Arrays) -> None:
        assert self._method is not None
        if "shared" in header and self._images is not None:
            arrays.update(self._images.arrays(header["shared"]))
        number, measurement = wire.unpack_measurement(header, arrays)
        arrays.clear()
        is_frame = sensor_kind(measurement.sensor).is_frame
        if is_frame:
            self._flush()  # what came before is not held up by a long frame
            if self._pacer is not None:
                self._pacer.take_frame(measurement.stamp)
        began = self._method.processor_time()
        estimate = self._method.feed(measurement)
        compute = max(0, self._method.processor_time() - began)
        del measurement  # unless the method keeps it, its image slot is free now
        if estimate is None and not is_frame:
            self._acknowledge = number
            self._compute += compute
            return
        self._say_acknowledged()
        reply: messages.Header = {"say": "done", "number": number, "compute": compute}
        if self._pacer is not None and is_frame:
            # Its threads share the work of a frame, but where others hold the cores, the wall clock tells too much.
            reply["took"] = min(max(self._pacer.took(), 0), compute)
        if self._images is not None and (released := self._images.released()):
            reply["released"] = released
        answer: messages.Arrays = {}
        if estimate is not None:
            reply["estimate"], answer = describe(estimate)
        self._out.append(messages.pack(reply, answer))
        if is_frame:
            self._flush()

    def _command(self, header: messages.Header) -> bool:
        """Obey one command; returns whether to go on."""
        match header["do"]:
            case "construct":
                self._name = header["method"]
                found = load_method(self._name)
                if found.card.asynchronous:
                    for variable in SINGLE_THREADED:
                        os.environ.pop(variable, None)
                    self._pacer = Pacer(header["cpu_scale"])
                self._method = self._guarded(lambda: construct(found, self._name, header["options"]))
                self._answer(card=dataclasses.asdict(self._method.card))
            case "start":
                assert self._method is not None
                method, rig = self._method, SensorRig.model_validate_json(header["rig"])
                if self._images is not None and cameras(rig).keys().isdisjoint(method.card.hears(cameras(rig))):
                    self._images.close()
                    self._images = None
                self._guarded(lambda: method.start(rig))
                self._answer()
            case "save_map" | "load_map" as verb:
                getattr(self._method, verb)(Path(header["file"]))
                self._answer()
            case "stop":
                assert self._method is not None
                self._method.stop()
                self._answer()
                return False
        return True

    def _guarded(self, step: Any) -> Any:
        """Run a step in which packages are imported for the first time; an absent one is not a crash."""
        try:
            return step()
        except ModuleNotFoundError as error:
            card = load_method(self._name).card
            raise registry.unavailable(self._name, card, error) from error

    def _answer(self, **content: object) -> None:
        self._say_acknowledged()
        self._out.append(messages.pack({"say": "answer", **content}))
        self._flush()

    def _give_up(self, kind: str, detail: str, header: messages.Header) -> None:
        self._say_acknowledged()
        self._out.append(
            messages.pack({"say": "error", "kind": kind, "detail": detail, "number": header.get("number")})
        )
        self._flush()

    def _say_acknowledged(self) -> None:
        if self._acknowledge:
            self._out.append(messages.pack({"say": "done", "number": self._acknowledge, "compute": self._compute}))
            self._acknowledge = self._compute = 0

    def _flush(self) -> None:
        self._say_acknowledged()
        rest = memoryview(b"".join(self._out))
        self._out.clear()
        while rest:
            rest = rest[os.write(self._reply, rest) :]


def describe(estimate: object) -> tuple[dict[str, object], messages.Arrays]:
    """A pose estimate as it travels; whether its numbers make sense is for the host to judge.

    Raises:
        InvalidOutputError: it is not a PoseEstimate, or its parts have not the declared types or shapes.
    """
    if not isinstance(estimate, PoseEstimate):
        raise InvalidOutputError(f"feed returned {type(estimate).__name__}; expected PoseEstimate or None")
    if not isinstance(estimate.stamp, (int, np.integer)) or not isinstance(estimate.status, Status):
        raise InvalidOutputError(
            f"estimate with stamp {estimate.stamp!r:.80} and status {estimate.status!r:.80}; expected ns and a Status"
        )
    arrays = {"T_start_base": _array(estimate.T_start_base, (4, 4), "T_start_base")}
    if estimate.covariance is not None:
        arrays["covariance"] = _array(estimate.covariance, (3, 3), "covariance")
    return {"stamp": int(estimate.stamp), "status": estimate.status.value}, arrays


def _array(value: object, shape: tuple[int, int], name: str) -> np.ndarray[Any, Any]:
    try:
        array = np.asarray(value, dtype="<f8")
    except (TypeError, ValueError) as error:
        raise InvalidOutputError(f"{name} is not an array of numbers: {error}") from error
    if array.shape != shape:
        raise InvalidOutputError(f"{name} has shape {array.shape}; expected {shape}")
    return array


def main(arguments: list[str]) -> None:
    """Serve one method.

    Arguments: descriptors of the request and reply pipes and, if images are shared, the descriptor of their memory and
    the bytes of one slot.
    """
    request, reply, *shared = (int(argument) for argument in arguments)
    for descriptor in (request, reply, *shared[:1]):
        os.set_inheritable(descriptor, False)
    faulthandler.enable()
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(line_buffering=True)  # type: ignore[union-attr]
    _Child(request, reply, ImageWindow(*shared) if shared else None).run()


if __name__ == "__main__":
    main(sys.argv[1:])
