"""What becomes of a job is what stands on the disk, however its process ends."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from taskslam.benchmark.engine import Ending, Watcher
from taskslam.benchmark.engines import supervised
from taskslam.benchmark.engines.local import LocalEngine
from taskslam.benchmark.stage import Stage
from taskslam.mode import Mode
from taskslam.slam.cards import card_of
from taskslam.stopping import waits_are_interrupted


@pytest.fixture(autouse=True)
def known() -> None:
    """The method is described before a test puts something else in the place of the interpreter that would do it.

    And INT ends waits, whatever a test before has imported.
    """
    card_of("wheel_odometry")
    waits_are_interrupted()


@pytest.fixture
def job(make_stage: Callable[..., Stage], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], object]:
    """`job(code)`: the result of a run whose worker is a Python process that runs this code, and what was heard."""
    spec = make_stage().spec("wheel_odometry", Mode.WITHOUT_MAP)

    def run(code: str) -> object:
        interpreter = tmp_path / "python"
        interpreter.write_text(f"#!{sys.executable}\nimport json, os, signal, sys\njson.load(sys.stdin)\n{code}\n")
        interpreter.chmod(0o755)
        monkeypatch.setattr(supervised.sys, "executable", str(interpreter))
        heard: list[dict[str, object]] = []

        class Listening(Watcher):
            def goes_on(self, spec: object, progress: dict[str, object]) -> None:
                heard.append(progress)

        (result,) = LocalEngine().run([spec], tmp_path / "out", Listening())
        return result, heard

    return run


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("sys.exit(0)", "ended with status 0 and left no finished run"),
        ("sys.exit(1)", "ended with status 1 and left no finished run"),
        ("print('Killed by a library', file=sys.stderr); os._exit(7)", "said last: Killed by a library"),
        ("os.kill(os.getpid(), signal.SIGKILL)", "was killed by SIGKILL"),
        ("print(json.dumps({'complaint': 'the disk is full'})); sys.exit(3)", "the disk is full"),
    ],
)
def test_a_worker_that_leaves_no_run_has_failed(code: str, words: str, job: Callable[[str], object]) -> None:
    result, _ = job(code)
    assert result.ending is Ending.FAILED
    assert words in result.detail


def test_a_worker_that_refuses_is_refused_in_its_words(job: Callable[[str], object]) -> None:
    result, _ = job("print(json.dumps({'complaint': 'no such world'})); sys.exit(2)")
    assert (result.ending, result.detail) == (Ending.REFUSED, "no such world")


def test_a_flood_of_words_on_both_streams_stops_nobody(job: Callable[[str], object]) -> None:
    """More than a pipe holds on each, lines without an end, lines that are no progress, bytes that are no text."""
    code = """
for stream in (sys.stderr, sys.stdout):
    stream.write("x" * 300_000 + "\\n[1, 2]\\n17\\n" * 20_000)
    stream.flush()
os.write(1, b"\\xff\\xfe\\n")
print(json.dumps({"done": 0.5, "simulated_s": 3}), flush=True)
sys.stderr.write("y" * 300_000 + "\\nlast words\\n")
sys.exit(3)
"""
    result, heard = job(code)
    assert heard == [{"done": 0.5, "simulated_s": 3}]
    assert result.ending is Ending.FAILED
    assert result.detail.endswith("last words")


def test_what_a_library_prints_is_no_progress(make_stage: Callable[..., Stage], tmp_path: Path) -> None:
    import subprocess

    code = "import os, sys; from taskslam.benchmark.engines.worker import _own_output; own = _own_output()"
    code += "; print('noise', flush=True); os.system('echo more'); own.write('{}'); own.flush()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("{}", "noise\nmore\n")


def test_who_stops_listening_ends_the_workers(
    make_stage: Callable[..., Stage], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interpreter = tmp_path / "python"
    interpreter.write_text("#!/bin/sh\nexec sleep 60\n")
    interpreter.chmod(0o755)
    monkeypatch.setattr(supervised.sys, "executable", str(interpreter))
    specs = [make_stage().spec("wheel_odometry", Mode.WITHOUT_MAP, seed) for seed in range(3)]
    engine = LocalEngine(cores=2).run(specs, tmp_path / "out", Watcher())
    began = time.monotonic()
    threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        next(engine)
    assert time.monotonic() - began < 10
