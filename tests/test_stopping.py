"""A signal as an exception, and the blocks that it does not tear."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from pydantic import BaseModel, field_serializer
from pydantic_core import PydanticSerializationError

from taskslam.stopping import StoppedError, stop_behind, stop_on_signals, undisturbed


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    before = {one: signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    stop_on_signals()
    yield
    for one, handler in before.items():
        signal.signal(one, handler)


def tell() -> None:
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(0.01)


def test_a_signal_is_raised_where_it_comes() -> None:
    with pytest.raises(StoppedError, match="stopped by SIGTERM"):
        tell()


def test_a_signal_waits_for_the_end_of_the_outermost_block() -> None:
    done = []

    def work() -> None:
        with undisturbed():
            with undisturbed():
                tell()
                done.append("inner")
            done.append("outer")
        done.append("after")

    with pytest.raises(StoppedError, match="stopped by SIGTERM"):
        work()
    assert done == ["inner", "outer"]


def test_it_is_raised_once_and_the_door_is_open_again() -> None:
    with pytest.raises(StoppedError), undisturbed():
        tell()
    with undisturbed():
        pass


def test_the_error_of_the_block_is_kept_as_its_context() -> None:

    def work() -> None:
        with undisturbed():
            tell()
            raise OSError("torn")

    with pytest.raises(StoppedError) as stop:
        work()
    assert str(stop.value.__context__) == "torn"


class Told(BaseModel):
    """Is told to end while compiled code calls back."""

    number: int = 1

    @field_serializer("number")
    def _written(self, number: int) -> int:
        tell()
        return number


def test_a_stop_behind_an_error_of_compiled_code_is_found() -> None:
    other = ValueError("no stop")
    assert stop_behind(other) is other
    with pytest.raises(PydanticSerializationError) as turned:
        Told().model_dump_json()
    assert str(stop_behind(turned.value)) == "stopped by SIGTERM"
    leaving = SystemExit(3)
    assert stop_behind(leaving) is leaving


def test_other_threads_close_no_door() -> None:
    inside, enough = threading.Event(), threading.Event()

    def stay() -> None:
        with undisturbed():
            inside.set()
            enough.wait(10)

    thread = threading.Thread(target=stay)
    thread.start()
    inside.wait(10)
    try:
        with pytest.raises(StoppedError):
            tell()
    finally:
        enough.set()
        thread.join()


ASKS = """
import sys
from taskslam.stopping import StoppedError, stop_on_signals
stop_on_signals()
from taskslam.slam.cards import card_of
from taskslam.slam.guest.host import MethodHost
from taskslam.robot import load_robot
from pathlib import Path
rig = load_robot("turtlebot2").rig
print("ready", flush=True)
try:
    while True:
        with MethodHost("wheel_odometry", {}, rig, Path(sys.argv[1])):
            pass
except StoppedError:
    sys.exit(7)
"""


def test_a_signal_at_any_moment_of_a_start_or_stop_leaves_no_scratch(tmp_path: Path) -> None:
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    for moment in range(8):
        process = subprocess.Popen(
            [sys.executable, "-c", ASKS, str(tmp_path / "log")],
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "TMPDIR": str(scratch)},
        )
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        time.sleep(0.05 + 0.041 * moment)
        process.send_signal(signal.SIGTERM)
        assert process.wait(60) == 7
        assert [entry.name for entry in scratch.iterdir()] == [], moment


WAITS_FOR_A_LOCK = """
import os, signal, threading, time
from concurrent.futures import ThreadPoolExecutor
import numpy as np
from taskslam.table import Table
Table({"a": np.arange(3)}).to_polars()
threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
with ThreadPoolExecutor(1) as pool:
    waiting = pool.submit(time.sleep, 60)
    try:
        waiting.result()
    except KeyboardInterrupt:
        os._exit(7)
"""


def test_int_ends_a_wait_after_polars_was_imported() -> None:
    """polars hears INT itself, and by its flags a wait for a lock would go on to its end."""
    pytest.importorskip("polars")
    began = time.monotonic()
    done = subprocess.run(
        [sys.executable, "-c", WAITS_FOR_A_LOCK],
        timeout=90,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert done.returncode == 7
    assert time.monotonic() - began < 30
