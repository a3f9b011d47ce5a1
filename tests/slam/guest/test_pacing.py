import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from taskslam.measurements import NANOSECONDS, LaserScan
from taskslam.slam.guest import pacing
from taskslam.slam.guest.latency import LatencyModel

PERIOD_MS = 40
RANGES = np.full(8, 2.0, dtype=np.float32)


def scans(count):
    for n in range(count):
        yield LaserScan(n * PERIOD_MS * 1_000_000, RANGES, -1.0, 0.2, 0.1, 10.0)


def work_per_frame(host, frames, simulator_s):
    """What the method's thread did in each period, while every frame takes the simulator so long."""
    host.start()
    work = []
    for scan in scans(frames):
        time.sleep(simulator_s)
        host.feed(scan)
        work += [e.T_start_base[0, 3] for e in host.collect(scan.stamp)]
    host.stop()
    return np.array(work[3:])


@pytest.fixture
def crunch(host_of):
    def run(simulator_s, cpu_scale=1.0, frames=25, **options):
        host = host_of("threaded:Crunches", options, LatencyModel(cpu_scale=cpu_scale), frame_timeout_s=10.0)
        return work_per_frame(host, frames, simulator_s)

    return run


def test_background_work_does_not_depend_on_how_fast_the_simulator_is(crunch):
    fast, slow = crunch(0.0), crunch(4 * PERIOD_MS / 1000)
    assert fast.min() > 0
    assert np.median(slow) == pytest.approx(np.median(fast), rel=0.25)


def test_a_robot_that_is_half_as_fast_does_half_of_the_work(crunch):
    full, half = crunch(0.0), crunch(0.0, cpu_scale=2.0)
    assert np.median(half) == pytest.approx(np.median(full) / 2, rel=0.25)


def test_a_method_that_sleeps_is_not_waited_for(crunch):
    began = time.monotonic()
    crunch(0.0, frames=50, naps=0.003, works=False)
    asleep = time.monotonic() - began
    began = time.monotonic()
    crunch(0.0, frames=50)
    assert asleep < 0.75 * (time.monotonic() - began)


def test_a_method_that_always_works_is_given_no_more_than_a_while_of_a_gap(monkeypatch):
    monkeypatch.setattr(pacing, "LONGEST_PERIOD", 100_000_000)
    monkeypatch.setattr(pacing, "_others_runnable", lambda: True)
    pacer = pacing.Pacer(1.0)
    began = time.monotonic()
    for stamp in (0, 3600 * NANOSECONDS):
        pacer.take_frame(stamp)
    assert 0.1 <= time.monotonic() - began < 60.0


def freezes(host):
    deadline = time.monotonic() + 30.0
    while state(host) != "T" and time.monotonic() < deadline:
        time.sleep(0.005)
    return state(host) == "T"


def test_between_frames_the_process_is_frozen_and_ends_all_the_same(host_of):
    host = host_of("threaded:Crunches", frame_timeout_s=10.0, stop_timeout_s=10.0)
    host.start()
    for scan in scans(4):
        host.feed(scan)
        host.collect(scan.stamp)
    assert freezes(host)
    os.kill(pid(host), signal.SIGCONT)  # as a curious user might
    time.sleep(0.05)
    assert freezes(host)
    began = time.monotonic()
    host.stop()
    assert time.monotonic() - began < 9.0  # not by running out of its time


def pid(host):
    return host._guest.pid


def state(host):
    return Path(f"/proc/{pid(host)}/stat").read_text().rpartition(") ")[2][0]
