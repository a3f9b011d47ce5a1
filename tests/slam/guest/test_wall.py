"""The wall around the truth: a method gets what its card asks for, and cannot get at more (design D4, issue's wall)."""

import os
import re
import struct
from pathlib import Path

import pytest

from taskslam.measurements import NANOSECONDS, Sensor
from taskslam.processes import landlock
from taskslam.slam.conformance.drive import ConformanceDrive
from taskslam.slam.guest.host import Limits, MethodHost


class Snooping:
    """A drive with a method that looks around, and what it and we could see."""

    def __init__(self, rig, folder: Path) -> None:
        self.truths, self.memory = [], b""
        (folder / "truth.tum").write_text("0.3 1.23456 7.654321 0 0 0 0 1\n")
        host = MethodHost(
            "snooping:Snoop",
            {"redlof": str(folder)[::-1], "host": os.getpid()},
            rig,
            folder / "method.log",
            None,
            Limits(log_bytes=64 << 20),
        )
        with host:
            for measurement in ConformanceDrive(rig).measurements(0, 5 * NANOSECONDS):
                if measurement.sensor is Sensor.TRUE_POSE and measurement.stamp > 4.5 * NANOSECONDS:
                    self.truths += [measurement.T_start_base.x, measurement.T_start_base.theta]
                host.feed(measurement)  # true poses too, as a careless loop would
                host.collect(measurement.stamp)
            self.memory = memory_of(host._process.pid)
        self.log = (folder / "method.log").read_text(errors="replace")


def memory_of(process: int) -> bytes:
    """All readable memory of a child, as its parent may see it."""
    parts = []
    with Path(f"/proc/{process}/mem").open("rb", buffering=0) as memory:
        for line in Path(f"/proc/{process}/maps").read_text().splitlines():
            begin, end, rights = re.match(r"(\w+)-(\w+) (\S+)", line).groups()
            if rights.startswith("rw"):
                try:
                    memory.seek(int(begin, 16))
                    parts.append(memory.read(int(end, 16) - int(begin, 16)))
                except OSError:
                    continue
    return b"".join(parts)


@pytest.fixture(scope="module")
def snooping(rig, tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(Path(__file__).parents[1] / "guests"))
        yield Snooping(rig, tmp_path_factory.mktemp("run"))


def test_the_snoop_did_look(snooping):
    assert "SNOOPED" in snooping.log
    assert len(snooping.log) > 100_000


def test_no_true_pose_is_in_the_memory_of_the_method(snooping):
    assert len(snooping.memory) > 10 << 20
    assert len(snooping.truths) >= 48
    assert not [t for t in snooping.truths if struct.pack("<d", t) in snooping.memory]
    assert not [t for t in snooping.truths if repr(t).encode() in snooping.memory]


def test_odometry_would_be_found_in_the_memory_of_the_method(snooping, rig):
    """The search itself works: what the method was given is there."""
    given = [m for m in ConformanceDrive(rig).measurements(0, 5 * NANOSECONDS) if m.sensor is Sensor.WHEEL_ODOMETRY]
    assert any(struct.pack("<d", m.T_odom_base.x) in snooping.memory for m in given[-100:])


def test_no_true_pose_is_in_what_the_method_could_print(snooping):
    assert not [t for t in snooping.truths if repr(t) in snooping.log]


def test_the_hosts_memory_files_and_environment_are_closed(snooping):
    for name in ("environ", "mem", "maps", "auxv", "cwd", "exe", "root"):
        assert re.search(rf"^DENIED /proc/{os.getpid()}/{name} ", snooping.log, re.MULTILINE), name
    assert not re.search(r"^(READ|LINK) /proc/\d+/", snooping.log, re.MULTILINE)


def test_the_method_holds_no_descriptor_but_its_pipes(snooping):
    own = re.findall(r"^OWN (\d+) (.*)$", snooping.log, re.MULTILINE)
    assert {number for number, _ in own} >= {"0", "1", "2"}
    foreign = [target for _, target in own if not target.startswith(("pipe:", "/dev/null", "/proc/"))]
    assert foreign == []
    assert len(own) <= 6  # 0, 1, 2, requests, replies, and the folder being listed


def test_the_simulator_and_the_benchmark_are_not_loaded_beside_the_method(snooping):
    loaded = re.findall(r"^MODULE (taskslam\.\S+)", snooping.log, re.MULTILINE)
    assert "taskslam.slam.guest.child" in snooping.log
    assert not [m for m in loaded if m.startswith(("taskslam.simulation", "taskslam.benchmark", "taskslam.record"))]


@pytest.mark.skipif(not landlock.is_available(), reason="this kernel has no Landlock")
def test_the_results_cannot_be_read_by_the_method(snooping):
    assert re.search(r"^DENIED \S+truth.tum", snooping.log, re.MULTILINE)
    assert "7.654321" not in snooping.log


def test_the_methods_environment_is_a_short_list(snooping, monkeypatch):
    (line,) = re.findall(r"^ENVIRON (.*)$", snooping.log, re.MULTILINE)
    assert "TASKSLAM_DATA" not in line
    assert "PYTEST_CURRENT_TEST" not in line
    assert "OMP_NUM_THREADS" in line


@pytest.mark.skipif(not landlock.is_available(), reason="this kernel has no Landlock")
def test_command_lines_and_other_folders_are_closed(snooping):
    for name in ("cmdline", "status", "stat"):
        assert re.search(rf"^DENIED /proc/{os.getpid()}/{name} ", snooping.log, re.MULTILINE), name
    for folder in ("/proc", "/home", "/root", "/tmp", "/var", "/dev"):
        assert re.search(rf"^DENIED {folder} ", snooping.log, re.MULTILINE), folder
