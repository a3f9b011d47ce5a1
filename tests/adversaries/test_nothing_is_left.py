"""Nothing outlives a method: no process, descriptor, segment or file."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from adversaries.traces import LIMITS, TORTURE, Traces
from taskslam.geometry import SE2
from taskslam.measurements import WheelOdometry
from taskslam.processes.scratch import Scratch, sweep
from taskslam.robot import load_robot
from taskslam.slam.guest.host import MethodHost

DAEMONS = 50
STARTS = 500 if TORTURE else 12


def daemons_of(marker: str) -> list[int]:
    """Processes whose environment holds a marker."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdecimal() and marker.encode() in (entry / "environ").read_bytes():
                found.append(int(entry.name))
        except OSError:
            continue
    return found


def wait_for(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 30
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_no_daemon_lives_when_its_method_has_ended(
    guests: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    marker = f"TASKSLAM_METHOD_MARK=mark-{os.getpid()}-{time.time_ns()}"
    monkeypatch.setenv(*marker.split("=", 1))
    host = MethodHost(
        "daemons:Daemons", {"count": DAEMONS}, load_robot("turtlebot2").rig, tmp_path / "log", None, LIMITS
    )
    host.start()
    monkeypatch.delenv(marker.partition("=")[0])
    wait_for(lambda: len(daemons_of(marker)) >= DAEMONS)
    wait_for(lambda: host._process._tree.memory()[0] > DAEMONS << 20)  # they count, once they are looked for again
    host.stop()
    assert daemons_of(marker) == []


def test_daemons_of_a_method_that_crashes_end_too(guests: Path, tmp_path: Path, own_temporary_folder: Path) -> None:
    before = Traces.now()
    rig = load_robot("turtlebot2").rig
    host = MethodHost("daemons:Daemons", {"count": 5, "then": "segfault"}, rig, tmp_path / "log", None, LIMITS)
    with pytest.raises(Exception, match="SIGSEGV"):
        host.start()
    assert Traces.now().beyond(before) == []


def test_starts_and_stops_leave_nothing(guests: Path, tmp_path: Path, own_temporary_folder: Path) -> None:
    rig = load_robot("turtlebot2").rig
    before = None
    for number in range(STARTS):
        with MethodHost("wheel_odometry", {}, rig, tmp_path / "log", None, LIMITS) as host:
            host.feed(WheelOdometry(0, SE2(), 0.0, 0.0))
            assert len(host.collect(0)) == 1
        before = before or Traces.now()  # the first start loads what stays loaded
        assert Traces.now().beyond(before) == [], number
    assert list(own_temporary_folder.iterdir()) == []
    assert host.cpu_s > 0


def test_scratch_of_killed_processes_is_swept_and_that_of_living_ones_stays(own_temporary_folder: Path) -> None:
    stale = own_temporary_folder / "taskslam-method-stale"
    (stale / "closed").mkdir(parents=True)
    (stale / "closed").chmod(0)
    foreign = own_temporary_folder / "another-program"
    foreign.mkdir()
    with Scratch("living") as living:
        sweep.cache_clear()
        with Scratch("next") as following:
            assert sorted(own_temporary_folder.iterdir()) == sorted([foreign, living.folder, following.folder])
    assert list(own_temporary_folder.iterdir()) == [foreign]


def test_files_in_scratch_are_no_way_out(own_temporary_folder: Path, tmp_path: Path) -> None:
    outside = tmp_path / "outside"
    outside.write_text("kept")
    with Scratch("links") as scratch:
        (scratch.folder / "given").symlink_to(outside)
        with scratch.create("given") as file:
            file.write(b"map")
        (scratch.folder / "saved").symlink_to(outside)
        os.mkfifo(scratch.folder / "pipe")
        assert scratch.open("saved") is None
        assert scratch.open("pipe") is None
        assert scratch.open("absent") is None
        opened = scratch.open("given")
        assert opened is not None
        with opened:
            assert opened.read() == b"map"
    assert outside.read_text() == "kept"
