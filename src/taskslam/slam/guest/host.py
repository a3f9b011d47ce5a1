"""`MethodHost`: a SLAM method as a guest in its own process, on simulated time.

    host = MethodHost("karto", {}, robot.rig, folder / "method.log")
    host.start()
    for measurement in simulator.advance(until):
        host.feed(measurement)
    for estimate in host.collect(until):
        ...
    host.stop()

The child computes while the simulator goes on; `collect` waits only for answers that are due. What arrives when is
decided by stamps and latencies alone (`latency.py`), so the same input gives the same output on any machine. A method
that fails is reported when its answer is due, never earlier, for the same reason.
"""

from __future__ import annotations

import shutil
from collections import deque
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import TracebackType
from typing import NoReturn, Self

from taskslam.errors import (
    DiskFullError,
    HostFailedError,
    InputError,
    MethodUnavailableError,
    TaskSlamError,
    UnknownMethodError,
)
from taskslam.measurements import NANOSECONDS, Measurement
from taskslam.outcomes import Outcome
from taskslam.printable import one_line
from taskslam.processes import messages
from taskslam.processes.guest import GuestProcess, Limits, Program
from taskslam.processes.patience import Patience
from taskslam.processes.wall import Wall, working_folder
from taskslam.robot import Part, SensorRig
from taskslam.sensors import cameras
from taskslam.slam.base import MethodCard, PoseEstimate
from taskslam.slam.content import place_of
from taskslam.slam.guest import wire
from taskslam.slam.guest.contract import check_needs, read_card, read_estimate, what_is_wrong
from taskslam.slam.guest.enclosure import wall_of
from taskslam.slam.guest.failure import MethodFailedError
from taskslam.slam.guest.latency import NEVER, HandOver, LatencyModel, Schedule
from taskslam.slam.guest.shared_images import ImageSlots
from taskslam.slam.registry import find_method, is_local
from taskslam.stopping import undisturbed

_MAX_UNSENT = 64 << 20
_LONGEST_MAP = 4 << 30
_LONGEST_COMPUTE = 10**6 * NANOSECONDS
_LONGEST_DETAIL = 500
_INPUT_ERRORS = {"unknown": UnknownMethodError, "unavailable": MethodUnavailableError, "input": InputError}

__all__ = ["Limits", "MethodHost"]


class MethodHost:
    """One method, from start to stop. Calls raise `MethodFailedError` once the method has failed.

    method: a registered name or `package.module:Class`. log: file to which what the method prints is added; the folder
    that it lies in is closed to the method, and so is what `closed` lists. described: the card that the method was
    described with (`cards.card_of`): places that it names are opened, and a method that starts with another is refused.
    proven: it has started well before, in the same run: what fails at the start is then the method's own failure.
    frames: frames of the card's frame sensors fed; dropped_frames: those that the method never saw because it was busy;
    compute_s: CPU time that it spent in `feed`; cpu_s: of all its processes from start to end, once it has ended;
    peak_memory: bytes resident at most, in all its processes; stop_failure: how it failed while it was stopped, empty
    if it did not.
    """

    def __init__(
        self,
        method: str,
        options: Mapping[str, object],
        rig: SensorRig,
        log: Path,
        latency: LatencyModel | None = None,
        limits: Limits | None = None,
        described: MethodCard | None = None,
        closed: Sequence[Path] = (),
        proven: bool = False,
    ) -> None:
        self._name = method
        self._described = described
        self._closed = (log.parent, *closed)
        self._proven = proven
        self._rig = rig
        self._log = log
        self._latency = latency or LatencyModel()
        self._limits = limits or Limits()
        try:
            self._options = wire.option_values(options)
        except TypeError as error:
            raise InputError(f"method '{method}': option value {error}; expected text, numbers or lists") from error
        self._guest: GuestProcess | None = None
        self._images: ImageSlots | None = None
        self._card: MethodCard | None = None
        self._failure: MethodFailedError | None = None
        self._reader = messages.MessageReader(messages.MAX_REPLY)
        self._unsent = bytearray()
        self._outstanding: deque[HandOver] = deque()  # sent and not yet acknowledged
        self._awaited: deque[HandOver] = deque()  # those of them with an answer that will be due
        self._ready: deque[tuple[int, PoseEstimate]] = deque()
        self._undelivered: list[PoseEstimate] = []
        self._unanswered = 0  # commands
        self._answers: deque[messages.Header] = deque()
        self._doom: tuple[Outcome, str] | None = None
        self._last_stamp = -1
        self._starting = False
        self._answered: list[tuple[int, int, int]] = []
        self.compute_s = 0.0
        self.stop_failure = ""

    @property
    def card(self) -> MethodCard:
        """The card of the started method."""
        if self._card is None:
            raise HostFailedError(f"method '{self._name}' is not started")
        return self._card

    @property
    def frames(self) -> int:
        """Frames (scans, clouds, images) fed so far, the dropped ones included."""
        return self._schedule.frames if self._card else 0

    @property
    def dropped_frames(self) -> int:
        """Frames that the method never saw because it was busy."""
        return self._schedule.dropped if self._card else 0

    @property
    def peak_memory(self) -> int:
        """Most bytes of resident memory seen so far."""
        return self._guest.peak_memory if self._guest else 0

    @property
    def cpu_s(self) -> float:
        """Processor time of all the method's processes; 0 until it has ended."""
        return self._guest.cpu_s if self._guest else 0.0

    def start(self) -> None:
        """Start the process if it was not launched, and wait until the method is constructed and started.

        Raises:
            UnknownMethodError, MethodUnavailableError: no such method, or its package is absent.
            InputError: wrong options, or the method needs a sensor that the robot has not, or asks for the truth.
            HostFailedError: the process cannot be run. DiskFullError: the log cannot be written.
            MethodFailedError: it crashed or hung on the way, or, where it is `proven`, would not start.
        """
        try:
            if self._guest is None:
                self.launch()
            self._await_start()
        except InputError as error:
            if not self._proven:
                raise
            self._failure = MethodFailedError(Outcome.CRASHED, f"did not start again: {error}")
            raise self._failure from error

    @property
    def started(self) -> bool:
        """Whether it has started well."""
        return self._card is not None

    def launch(self) -> None:
        """Start the process and tell it what to construct and start, without waiting: `start` waits for it.

        Raises UnknownMethodError, InputError, HostFailedError and DiskFullError as `start` does.
        """
        if self._guest is not None:
            raise HostFailedError(f"method '{self._name}' was started already")
        self._cameras = cameras(self._rig)
        self._images = _image_slots(self._cameras.values())
        try:
            with undisturbed():
                self._guest = GuestProcess(self._program(), self._wall(), self._log, self._limits)
                self._tell(
                    do="construct",
                    method=find_method(self._name).name,
                    options=self._options,
                    cpu_scale=self._latency.cpu_scale,
                )
                self._tell(do="start", rig=self._rig.model_dump_json())
            self._guest.write(self._unsent)
        except BaseException:
            self._end()
            raise

    @contextmanager
    def launched(self) -> Iterator[Self]:
        """Launch it beside what else has to be made ready; whatever comes, it is stopped at the end.

        A `proven` one begins at `start`: what fails then is its own failure, and belongs to a round.
        """
        with ExitStack() as stack:
            stack.push(self)
            if not self._proven:
                self.launch()
            yield self

    def _await_start(self) -> None:
        self._starting = True
        try:
            timeout = self._limits.start_timeout_s
            card = read_card(self._name, self._answer_to("be constructed", timeout))
            if self._described is not None and card != self._described:
                raise InputError(
                    f"method '{self._name}': its card at the start is not the one that it was described by"
                )
            self._process.freezes_itself = card.asynchronous
            check_needs(card, self._rig)
            self._hears = card.hears(card.optional_sensors)
            self._schedule = Schedule(self._hears, card.queue, self._latency.before(card.latency))
            self._answer_to("start", timeout)
            self._card = card
            self._process.keep_compiled()
        except BaseException:
            self._end()
            raise
        finally:
            self._starting = False

    def feed(self, measurement: Measurement) -> None:
        """Offer one measurement, in stamp order; waits for the method only in `measured` mode.

        Sensors that the card does not ask for are passed over in silence.

        Raises:
            MethodFailedError: the method failed on something that was due before.
            ValueError: the measurement is older than one before it.
        """
        if measurement.sensor not in self._hears:
            return
        self._raise_failure()
        if self._schedule.unsettled:
            measurement.work_out()  # beside the method, which is waited for below
        self._pass_time(measurement.stamp)
        self._send(self._schedule.offer(measurement))
        if len(self._unsent) > _MAX_UNSENT:
            self._await_outstanding(self._outstanding[0].number)

    def collect(self, until: int) -> list[PoseEstimate]:
        """Estimates delivered up to `until` (ns of simulated time) that were not collected yet, in stamp order.

        Raises:
            MethodFailedError: an answer that is due did not come, or is not a pose.
        """
        self._raise_failure()
        self._pass_time(until)
        self._process.write(self._unsent)
        while self._awaited and (self._awaited[0].due is None or self._awaited[0].due <= until):
            self._await_outstanding(self._awaited[0].number)
        estimates = []
        while self._ready and self._ready[0][0] <= until:
            estimates.append(self._ready.popleft()[1])
        if self._process.log_error is not None:
            raise DiskFullError(f"{self._log}: cannot write the method's log: {self._process.log_error.strerror}")
        return estimates

    def save_map(self, path: Path) -> None:
        """Have the method write its map to `path`, whole or not at all. The method never learns the path.

        Raises:
            InputError: its card says that it cannot. DiskFullError: `path` cannot be written. MethodFailedError.
        """
        self._need_maps("save")
        self._ask("save its map", self._limits.start_timeout_s, do="save_map", file="saved-map")
        made, partial = self._process.files.open("saved-map"), path.with_name(path.name + ".part")
        if made is None:
            self._fail(Outcome.INVALID_OUTPUT, "save_map wrote no file")
        with made:
            if made.seek(0, 2) > _LONGEST_MAP:
                self._fail(Outcome.INVALID_OUTPUT, f"save_map wrote more than {_LONGEST_MAP / 1e9:.0f} GB")
            made.seek(0)
            try:
                partial.unlink(missing_ok=True)
                with partial.open("xb") as file:
                    shutil.copyfileobj(made, file)
                partial.replace(path)
            except OSError as error:
                raise DiskFullError(f"{path}: cannot write the map: {error.strerror}") from error

    def load_map(self, path: Path) -> None:
        """Give the method a map that `save_map` wrote; right after `start`.

        Raises:
            InputError: its card says that it cannot, or the file cannot be read. MethodFailedError: it refuses it.
        """
        self._need_maps("load")
        try:
            with path.open("rb") as source, self._process.files.create("given-map") as given:
                shutil.copyfileobj(source, given)
        except OSError as error:
            raise InputError(f"{path}: cannot read the map: {error.strerror}") from error
        self._ask("load its map", self._limits.start_timeout_s, do="load_map", file="given-map")

    def stop(self) -> None:
        """End the method: ask it to stop, wait a little, kill what is left. May be called any number of times.

        A method that fails now has done its work: `stop_failure` says how.
        """
        if self._guest is None or self._guest.ended:
            return
        try:
            if self._failure is None and self._card is not None:
                try:
                    self._ask("stop", self._limits.stop_timeout_s, do="stop")
                except MethodFailedError as failure:
                    self.stop_failure = failure.detail
                ending = self._end(self._limits.stop_timeout_s)
                if ending and not self.stop_failure:
                    self.stop_failure = f"{self._name} {ending} after it was stopped"
        finally:
            self._end()
        if self._guest.log_error is not None and self._failure is None:
            raise DiskFullError(f"{self._log}: cannot write the method's log: {self._guest.log_error.strerror}")

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        try:
            self.stop()
        except TaskSlamError:
            if error is None:
                raise

    @property
    def _process(self) -> GuestProcess:
        assert self._guest is not None
        return self._guest

    def _program(self) -> Program:
        images = self._images
        return Program(
            "taskslam.slam.guest.child",
            () if images is None else (str(images.fileno), str(images.slot_size)),
            () if images is None else (images.fileno,),
            working_folder() if is_local(self._name) else None,
            place_of("compiled", find_method(self._name)),
        )

    def _wall(self) -> Wall:
        named = [Path(value) for value in self._options.values() if isinstance(value, str) and "/" in value]
        return wall_of(self._name, self._described, named, self._closed)

    def _end(self, grace_s: float = 0.0) -> str:
        try:
            return self._guest.end(grace_s) if self._guest else ""
        finally:
            self._close_images()

    def _close_images(self) -> None:
        if self._images is not None:
            self._images.close()
            self._images = None

    def _pass_time(self, until: int) -> None:
        """Hand over queued frames whose turn comes by `until`; in `measured` mode learn each frame's time first."""
        while True:
            if self._schedule.unsettled:
                self._await_outstanding(self._outstanding[-1].number)
            handed = self._schedule.advance(until)
            self._send(handed)
            if not self._schedule.unsettled:
                return

    def _send(self, handed: list[HandOver]) -> None:
        for hand_over in handed:
            share = self._images.put if self._images and hand_over.measurement.sensor in self._cameras else None
            self._unsent += wire.pack_measurement(hand_over.number, hand_over.measurement, share)
            self._outstanding.append(hand_over)
            if hand_over.due != NEVER:
                self._awaited.append(hand_over)
            if self._schedule.occupies(hand_over.measurement):
                self._process.write(self._unsent)  # the child works on it while the simulator goes on

    def _await_outstanding(self, number: int) -> None:
        """Wait until everything up to message `number` is answered."""
        while self._outstanding and (first := self._outstanding[0]).number <= number:
            patience = Patience(self._limits.frame_timeout_s)
            while self._outstanding and self._outstanding[0] is first:
                self._hear(_words(first), patience)

    def _ask(self, what: str, timeout_s: float, **command: object) -> messages.Header:
        """Send a command and wait for its answer."""
        self._raise_failure()
        self._tell(**command)
        return self._answer_to(what, timeout_s)

    def _tell(self, **command: object) -> None:
        self._unsent += messages.pack(command)
        self._unanswered += 1

    def _answer_to(self, what: str, timeout_s: float) -> messages.Header:
        """Wait for the answer to the oldest command that has none yet."""
        patience = Patience(timeout_s)
        while not self._answers:
            self._hear(f"the request to {what}", patience)
        return self._answers.popleft()

    def _hear(self, about: str, patience: Patience) -> None:
        """Wait for bytes of the child while patience lasts, and take in the messages that they complete.

        A failure that these tell of later measurements is kept until those are due.
        """
        if self._doom is not None:
            self._fail(*self._doom)
        data = self._process.exchange(self._unsent, patience)
        if data is None:
            self._fail(Outcome.STALLED, f"gave no answer to {about} within {patience.limit_s:g} s")
        if not data:
            self._fail(Outcome.CRASHED, f"{self._process.ending()} at {about}")
        try:
            for header, arrays in self._reader.messages(data):
                match header.get("say"):
                    case "done":
                        self._take_done(header, arrays)
                    case "answer":
                        self._take_answer(header)
                    case "error":
                        self._take_error(header, about)
                    case other:
                        raise messages.WireError(f"unknown message {other!r:.80}")
                if self._doom is not None:
                    return
        except InputError:
            raise
        except messages.WireError as error:
            self._fail(Outcome.INVALID_OUTPUT, f"its process wrote into the reply pipe: {error}")
        except Exception as error:  # whatever it said, it can only hurt the method (design D13)
            self._fail(
                Outcome.INVALID_OUTPUT, f"its process said what nobody understands: {type(error).__name__}: {error}"
            )

    def answered(self) -> list[tuple[int, int, int]]:
        """(stamp, compute, latency) in ns of the frames that the method has answered since the last call.

        compute: its CPU time; latency: from the stamp until its estimate is delivered, in simulated time.
        """
        answered, self._answered = self._answered, []
        return answered

    def _take_answer(self, header: messages.Header) -> None:
        if not self._unanswered:
            raise messages.WireError("an answer that nobody asked for")
        self._unanswered -= 1
        self._answers.append(header)

    def _take_done(self, header: messages.Header, arrays: messages.Arrays) -> None:
        number, compute = header.get("number"), header.get("compute")
        if type(number) is not int or type(compute) is not int or not 0 <= compute <= _LONGEST_COMPUTE:
            raise messages.WireError("an acknowledgement without a number and the time that it took")
        if self._images is not None:
            self._images.release(header.get("released", ()))
        self.compute_s += compute / NANOSECONDS
        while self._outstanding and self._outstanding[0].number < number:
            self._finish(0)
        if not self._outstanding or self._outstanding[0].number != number:
            raise messages.WireError(f"an acknowledgement of message {number}, which is not outstanding")
        estimate: PoseEstimate | None = None
        if "estimate" in header:
            cause = self._outstanding[0].measurement
            estimate = read_estimate(header["estimate"], arrays)
            if wrong := what_is_wrong(estimate, cause.stamp, self._last_stamp):
                self._doom = (Outcome.INVALID_OUTPUT, f"returned {wrong}, at {_words(self._outstanding[0])}")
                return
        if estimate is not None:
            self._last_stamp = estimate.stamp
            self._undelivered.append(estimate)
        took = header.get("took", compute)
        if type(took) is not int or not 0 <= took <= _LONGEST_COMPUTE:
            raise messages.WireError("an acknowledgement without the time that it took")
        self._finish(took)

    def _finish(self, took: int) -> None:
        """Take the oldest outstanding measurement as done; what the method said of it is delivered when it is due."""
        done = self._outstanding.popleft()
        due = self._schedule.settle(done, self._latency.after(took)) if done.due is None else done.due
        if self._schedule.occupies(done.measurement):
            self._answered.append((done.measurement.stamp, took, due - done.measurement.stamp))
        if due != NEVER:
            self._awaited.popleft()
            self._ready.extend((due, estimate) for estimate in self._undelivered)
            self._undelivered.clear()

    def _take_error(self, header: messages.Header, about: str) -> None:
        kind, detail = str(header.get("kind")), one_line(str(header.get("detail")), _LONGEST_DETAIL)
        if kind in _INPUT_ERRORS and self._starting:  # what the user asked for was at fault, so the method says
            self._failure = MethodFailedError(Outcome.CRASHED, f"{self._name} ended: {detail}")
            self._end()
            raise _INPUT_ERRORS[kind](detail)
        if self._outstanding:
            about = _words(self._outstanding[0])
        if kind == "invalid":
            self._doom = (Outcome.INVALID_OUTPUT, f"returned {detail}, at {about}")
        elif kind == "stalled":
            self._doom = (Outcome.STALLED, f"waits for what no longer answers: {detail}, at {about}")
        else:
            self._doom = (Outcome.CRASHED, f"raised {detail}, at {about}")

    def _need_maps(self, verb: str) -> None:
        if not self.card.can_save_map:
            raise InputError(f"method '{self._name}' cannot {verb} maps (can_save_map is false on its card)")

    def _raise_failure(self) -> None:
        if self._failure is not None:
            raise self._failure

    def _fail(self, outcome: Outcome, detail: str) -> NoReturn:
        self._failure = MethodFailedError(outcome, one_line(f"{self._name} {detail}", 2 * _LONGEST_DETAIL))
        self._end()
        raise self._failure


def _image_slots(cameras: Collection[Part]) -> ImageSlots | None:
    """Shared memory for images, or None where there are no cameras or no such memory: the pipe works too."""
    try:
        return ImageSlots(cameras) if cameras else None
    except OSError:
        return None


def _words(hand_over: HandOver) -> str:
    measurement = hand_over.measurement
    return f"the {measurement.sensor.replace('_', ' ')} at {measurement.stamp / NANOSECONDS:.3f} s"
