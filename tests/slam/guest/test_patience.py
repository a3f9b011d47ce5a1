"""A limit on the wall's clock does not count the time in which we stood still."""

import os
import signal
import subprocess
import sys

import pytest

from taskslam.processes.patience import Patience

WAITS = """
import sys, time
from taskslam.processes.patience import Patience
began = time.monotonic()
patience = Patience(1.0, 0.1)
print("waiting", flush=True)
while patience.look():
    time.sleep(0.01)
print(time.monotonic() - began)
"""


def test_it_counts_down_from_look_to_look_and_stays_at_nothing():
    now = [100.0]
    patience = Patience(2.0, 1.0, lambda: now[0])
    left = []
    for step in (0.0, 0.5, 0.25, 1.0, 1.0, 5.0):
        now[0] += step
        left.append(patience.look())
    assert left == [2.0, 1.5, 1.25, 0.25, 0.0, 0.0]
    assert patience.waited == pytest.approx(3.75)


def test_a_look_that_comes_late_counts_as_the_longest():
    now = [0.0]
    patience = Patience(2.0, 1.0, lambda: now[0])
    now[0] = 3600.0
    assert patience.look() == 1.0


def test_a_process_that_is_stopped_meanwhile_waits_its_time_all_the_same():
    waiting = subprocess.Popen([sys.executable, "-c", WAITS], stdout=subprocess.PIPE, text=True)
    with waiting:
        waiting.stdout.readline()
        os.kill(waiting.pid, signal.SIGSTOP)
        with pytest.raises(subprocess.TimeoutExpired):
            waiting.wait(1.5)
        os.kill(waiting.pid, signal.SIGCONT)
        assert float(waiting.communicate(timeout=30)[0]) > 1.5 + 0.8
