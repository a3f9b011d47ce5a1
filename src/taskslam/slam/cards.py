"""What methods declare, learned without running any of their code here: a confined process describes them.

Cards are kept between runs of this program, by the content of the package that a method is in.
"""

from __future__ import annotations

import dataclasses
import json
import os
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from taskslam.errors import InputError, MethodUnavailableError, TaskSlamError
from taskslam.printable import one_line
from taskslam.processes import messages
from taskslam.processes.guest import GuestProcess, Limits, Program
from taskslam.processes.patience import Patience
from taskslam.processes.scratch import Scratch
from taskslam.processes.wall import working_folder
from taskslam.reading import LARGEST_WRITTEN_BY_HAND, read_json
from taskslam.slam.base import MethodCard
from taskslam.slam.content import place_of
from taskslam.slam.guest.contract import read_card
from taskslam.slam.guest.enclosure import wall_of
from taskslam.slam.registry import MethodEntry, find_method, is_local, missing_of_extra, registered_methods
from taskslam.stopping import undisturbed

_LIMITS = Limits(frame_timeout_s=60.0, stop_timeout_s=0.0, memory_bytes=2 << 30)
_LONGEST_PROBLEM = 500


@dataclass(frozen=True, slots=True)
class MethodState:
    """What is known of a method without running it: its card, or why it cannot be had (`problem`, else empty).

    unavailable: there is no card because a package is not installed.
    """

    entry: MethodEntry
    card: MethodCard | None
    problem: str
    unavailable: bool = False


def card_of(name: str) -> MethodCard:
    """What a method declares.

    Raises:
        UnknownMethodError: no such method.
        MethodUnavailableError: a package that it needs is not installed; names the extra.
        InputError: what the name leads to cannot be imported, or is not a SLAM method with a valid card.
    """
    (state,) = _states([find_method(name)])
    if state.card is None:
        raise (MethodUnavailableError if state.unavailable else InputError)(state.problem)
    return state.card


def inspect_methods() -> list[MethodState]:
    """Every registered method with its card, or with the reason why it is broken. None of them stops the others."""
    return [_installed(state) for state in _states(list(registered_methods().values()))]


def inspect_method(name: str) -> MethodState:
    """One method's card, and whether its packages are installed.

    Raises:
        UnknownMethodError: no such method.
    """
    (state,) = _states([find_method(name)])
    return _installed(state)


def _states(entries: Sequence[MethodEntry]) -> list[MethodState]:
    known = {entry: _kept(entry) for entry in entries}
    missing: dict[str, list[MethodEntry]] = defaultdict(list)
    for entry, card in known.items():
        if card is None:
            missing[entry.distribution or entry.name].append(entry)
    learned = {state.entry: state for group in missing.values() for state in _described(group)}
    for state in learned.values():
        _keep(state)
    return [learned[entry] if entry in learned else MethodState(entry, card, "") for entry, card in known.items()]


def _installed(state: MethodState) -> MethodState:
    """With what of its extra is not installed; an absent package may only be missed at the start."""
    if state.card is None:
        return state
    return dataclasses.replace(state, problem=missing_of_extra(state.entry, state.card.extra))


def _described(entries: Sequence[MethodEntry]) -> list[MethodState]:
    """By as few processes as their code allows: where one is ended by a method, the next goes on behind it."""
    states: list[MethodState] = []
    while len(states) < len(entries):
        rest = entries[len(states) :]
        answered, ending = _ask([entry.name for entry in rest])
        states += [_state(entry, answer) for entry, answer in zip(rest, answered, strict=False)]
        if len(answered) < len(rest):
            entry = rest[len(answered)]
            states.append(
                MethodState(entry, None, f"method '{entry.name}': its process {ending} while it was imported")
            )
    return states


def _ask(names: Sequence[str]) -> tuple[list[messages.Header], str]:
    """The answers that a describing process gives to these names, as far as it comes, and how it ended."""
    local = working_folder() if is_local(names[0]) else None
    program = Program("taskslam.slam.guest.describe", local=local)
    with Scratch("cards") as scratch:
        process = None
        try:
            with undisturbed():
                process = GuestProcess(program, wall_of(names[0], None, (), ()), scratch.folder / "log", _LIMITS)
            return _answers(process, names)
        finally:
            if process is not None:
                process.end(0.0)


def _answers(process: GuestProcess, names: Sequence[str]) -> tuple[list[messages.Header], str]:
    reader = messages.MessageReader(0)
    asked = bytearray(messages.pack({"describe": list(names)}))
    answers: list[messages.Header] = []
    patience = Patience(_LIMITS.frame_timeout_s * len(names))
    try:
        while len(answers) < len(names):
            data = process.exchange(asked, patience)
            if data is None:
                return answers, "did not answer"
            if not data:
                return answers, process.ending()
            for header, _ in reader.messages(data):
                if header.get("method") != names[len(answers)] or not ("card" in header or "problem" in header):
                    return answers, "said what is no description"
                answers.append(header)
                if len(answers) == len(names):
                    break
    except TaskSlamError as error:
        return answers, f"said what is no description ({one_line(str(error), _LONGEST_PROBLEM)})"
    return answers, ""


def _state(entry: MethodEntry, answer: messages.Header) -> MethodState:
    if "card" in answer:
        try:
            return MethodState(entry, read_card(entry.name, answer), "")
        except InputError as error:
            return MethodState(entry, None, str(error))
    problem = one_line(str(answer.get("problem")), _LONGEST_PROBLEM)
    return MethodState(entry, None, problem, answer.get("unavailable") is True)


def _keep(state: MethodState) -> None:
    file = _file(state.entry)
    if file is None or state.card is None:
        return
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        partial = file.with_suffix(f".{os.getpid()}")  # whole or absent, and no matter if a crash takes it
        partial.write_text(json.dumps(dataclasses.asdict(state.card)), encoding="utf-8")
        partial.replace(file)
    except OSError:  # it is asked again next time
        return


def _kept(entry: MethodEntry) -> MethodCard | None:
    file = _file(entry)
    try:
        return None if file is None else read_kept_card(file, entry.name)
    except InputError:
        return None


def read_kept_card(file: Path, method: str) -> MethodCard:
    """A card that was kept. Raises InputError: it cannot be read, or is not valid."""
    return read_card(method, {"card": read_json(file, "card", InputError, LARGEST_WRITTEN_BY_HAND)})


def _file(entry: MethodEntry) -> Path | None:
    place = place_of("cards", entry)
    return None if place is None else place.with_suffix(".json")
