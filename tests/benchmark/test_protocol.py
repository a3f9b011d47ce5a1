"""Rounds and modes with a traveller and a platform of paper: no world, no method, no navigation."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest

from taskslam.benchmark.platform import Platform
from taskslam.benchmark.protocol import Tour, drive_tour
from taskslam.benchmark.traveller import Effort, Journey, Poses
from taskslam.errors import InfrastructureError
from taskslam.geometry import SE2
from taskslam.measurements import Measurement
from taskslam.mode import Mode
from taskslam.observer import Observer
from taskslam.outcomes import Outcome
from taskslam.record import DrivenBy, RunWriter
from taskslam.record.journal import read_journal
from taskslam.slam.guest.failure import MethodFailedError
from taskslam.task import Task

SECOND = 1_000_000_000


class PaperPlatform(Platform):
    """Writes down what it is asked."""

    driven_by = DrivenBy.ROBOT

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.time = 0

    @property
    def zero_utc(self) -> datetime:
        return datetime(2030, 1, 1, tzinfo=UTC)

    @property
    def now(self) -> int:
        return self.time

    def open(self) -> None:
        self.asked.append("open")

    def place(self, pose: SE2) -> None:
        self.asked.append("place")

    def advance(self, until: int) -> Iterator[Measurement]:
        self.time = until
        return iter(())

    def drive(self, linear: float, angular: float) -> None:
        self.asked.append("drive")

    def halt(self) -> None:
        self.asked.append("halt")

    def true_pose(self) -> SE2 | None:
        return None

    def bumped(self) -> bool:
        return False

    def close(self) -> None:
        self.asked.append("close")


class PaperTraveller:
    """Is at once where it is told to go, but for what `fails` says of (round, x of the goal)."""

    def __init__(self, platform: PaperPlatform, fails: dict[tuple[int, float], Outcome | BaseException]) -> None:
        self.platform = platform
        self.fails = fails
        self.round = 0
        self.at = SE2()
        self.stopped = False

    def start(self, still_s: float) -> None:
        self.platform.place(SE2())
        self.wait(still_s)

    def begin_round(self, number: int) -> None:
        self.round = number

    def go_to(self, goal: SE2) -> Journey:
        self.platform.drive(0.3, 0.0)
        self.platform.time += SECOND
        failure = self.fails.get((self.round, goal.x))
        if isinstance(failure, BaseException):
            raise failure
        if failure is not None:
            return Journey(failure, "as told")
        self.at = goal
        return Journey(Outcome.REACHED)

    def wait(self, seconds: float) -> None:
        self.platform.time += round(seconds * SECOND)

    def poses(self) -> Poses:
        return Poses(None, self.at, None)

    def effort(self) -> Effort:
        return Effort(frames=self.platform.time // SECOND)

    def stop(self) -> None:
        if not self.stopped:  # may be called more than once
            self.platform.asked.append("stop")
        self.stopped = True


def drive(
    folder: Path,
    mode: Mode,
    fails: dict[tuple[int, float], Outcome | BaseException],
    on_failure: str = "abort",
    platform: PaperPlatform | None = None,
) -> tuple[list[tuple[str, object, object]], PaperPlatform, bool]:
    """Kind, round and goal of every event; the platform; whether all was reached."""
    task = Task.model_validate(
        {
            "sequence": {"waypoints": [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]},
            "protocol": {"rounds": 2, "on_failure": on_failure},
        }
    )
    with RunWriter(folder / "run") as record:
        platform = platform or PaperPlatform()
        tour = Tour(task, platform, lambda: PaperTraveller(platform, fails), record, Observer())
        with platform:
            complete = drive_tour(tour, mode)
        events = read_journal(record.folder / "journal.jsonl").events
    told = [(event.kind, getattr(event, "round", None), getattr(event, "goal", None)) for event in events]
    return told, platform, complete


def rounds(told: list[tuple[str, object, object]]) -> list[str]:
    return [
        f"{kind} {number} {goal}" for kind, number, goal in told if kind in ("arrival", "goal_failed", "goal_skipped")
    ]


def test_without_map_every_round_is_a_life_of_its_own(tmp_path: Path) -> None:
    told, platform, complete = drive(tmp_path, Mode.WITHOUT_MAP, {})
    assert complete
    assert rounds(told) == ["arrival 0 0", "arrival 0 1", "arrival 1 0", "arrival 1 1"]
    assert platform.asked == ["open", *["place", "drive", "drive", "stop"] * 2, "halt", "close"]


def test_with_map_one_life_holds_a_priming_round_and_those_that_count(tmp_path: Path) -> None:
    told, platform, complete = drive(tmp_path, Mode.WITH_MAP, {})
    assert complete
    assert [number for kind, number, _ in told if kind == "round_started"] == [0, 1, 2]
    assert platform.asked == ["open", "place", *["drive"] * 6, "stop", "halt", "close"]


def test_the_robot_halts_whenever_a_goal_has_failed(tmp_path: Path) -> None:
    told, platform, complete = drive(tmp_path, Mode.WITHOUT_MAP, {(0, 1.0): Outcome.NO_PLAN}, on_failure="skip")
    assert not complete
    assert rounds(told) == ["goal_failed 0 0", "arrival 0 1", "arrival 1 0", "arrival 1 1"]
    assert platform.asked[:6] == ["open", "place", "drive", "halt", "drive", "stop"]


def test_the_robot_halts_when_the_method_dies_and_later_rounds_are_driven(tmp_path: Path) -> None:
    died = MethodFailedError(Outcome.CRASHED, "gone")
    told, platform, _ = drive(tmp_path, Mode.WITHOUT_MAP, {(0, 2.0): died})
    assert rounds(told) == ["arrival 0 0", "goal_failed 0 1", "arrival 1 0", "arrival 1 1"]
    assert platform.asked[:7] == ["open", "place", "drive", "drive", "halt", "stop", "place"]


def test_whatever_is_raised_the_robot_halts_before_the_method_ends_and_the_platform_is_closed(tmp_path: Path) -> None:
    platform = PaperPlatform()
    with pytest.raises(KeyboardInterrupt):
        drive(tmp_path, Mode.WITHOUT_MAP, {(0, 2.0): KeyboardInterrupt()}, platform=platform)
    assert platform.asked == ["open", "place", "drive", "drive", "halt", "stop", "halt", "close"]


def test_a_platform_that_cannot_be_opened_lets_go_of_what_it_holds() -> None:
    class Unplugged(PaperPlatform):
        def open(self) -> None:
            raise InfrastructureError("no such port")

    platform = Unplugged()
    with pytest.raises(InfrastructureError, match="no such port"), platform:
        pass
    assert platform.asked == ["close"]
