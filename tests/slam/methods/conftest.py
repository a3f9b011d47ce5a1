"""A method of a 3D LiDAR fed with the conformance drive, each test in a process of its own."""

import os
import subprocess
import sys
import traceback
from dataclasses import dataclass

import numpy as np
import pytest

from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS
from taskslam.slam.conformance.drive import ConformanceDrive


@dataclass
class Followed:
    """estimates: all of them; errors: m, planar, of those that track, against the truth at their own stamps."""

    estimates: list
    errors: np.ndarray


@pytest.fixture(scope="session")
def follow():
    """Drives a started method for so many seconds; change: what is done to each measurement before it is fed."""

    def run(method, rig, seconds, change=lambda m: m):
        drive = ConformanceDrive(rig, sensors=method.card.sensors)
        fed = (m for m in drive.measurements(0, round(seconds * NANOSECONDS)) if m.sensor in method.card.sensors)
        answers = [method.feed(change(m)) for m in fed]
        estimates = [answer for answer in answers if answer is not None]
        tracked = [e for e in estimates if e.status == "tracking"]
        errors = [drive.pose(e.stamp).distance_to(SE2.from_matrix(e.T_start_base)) for e in tracked]
        return Followed(estimates, np.array(errors))

    return run


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem):
    """Run each test of wrapped packages in a process of its own, as the benchmark does.

    Their native libraries bring thread pools of their own; several of them in one process have crashed it.
    """
    if pyfuncitem.path.name not in {"test_lidar_methods.py", "test_cuvslam.py"}:
        return None
    status, said = _in_child(pyfuncitem)
    if status < 0 and _AFRESH not in os.environ:
        # se3-lio now and then aborts inside its own library, by what lies in memory that it never wrote: a flaw of the
        # package that must not fail ours. A child of this process has the same memory, a fresh one has not.
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", pyfuncitem.nodeid]
        status = subprocess.run(command, cwd=pyfuncitem.config.rootpath, env=os.environ | {_AFRESH: "1"}).returncode
    if status == _SKIPPED:
        pytest.skip(said)
    if status != 0:
        pytest.fail(said or f"the test's process ended with {status}, in a fresh one too", pytrace=False)
    return True


def _in_child(pyfuncitem):
    """Exit status (negative: the signal) and what the child said."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os._exit(_run_in_child(pyfuncitem, writer))
    os.close(writer)
    with os.fdopen(reader, encoding="utf-8", errors="replace") as pipe:
        said = pipe.read()
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), said


_AFRESH = "TASKSLAM_TEST_AFRESH"
_SKIPPED = 77


def _run_in_child(pyfuncitem, writer):
    arguments = {name: pyfuncitem.funcargs[name] for name in pyfuncitem._fixtureinfo.argnames}
    try:
        pyfuncitem.obj(**arguments)
    except pytest.skip.Exception as reason:
        os.write(writer, str(reason).encode())
        return _SKIPPED
    except BaseException:
        os.write(writer, traceback.format_exc().encode())
        return 1
    return 0
