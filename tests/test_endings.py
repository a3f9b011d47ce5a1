"""How a process ends, seen from outside."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

MAIN = "import sys; from taskslam.cli.main import main; main()"
BREAKS = """
import sys
from taskslam.cli import app
def broken():
    raise {error}
app.app.command("broken")(broken)
sys.argv[1:] = ["broken"]
from taskslam.cli.main import main
main()
"""


def ran(code: str, *arguments: str, **named: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code, *arguments], text=True, timeout=60, **named)


@pytest.mark.parametrize(
    ("error", "words"),
    [
        ("RuntimeError('two\\nlines')", "unexpected RuntimeError: two lines"),
        ("MemoryError()", "out of memory"),
        ("EOFError()", "unexpected EOFError"),
        ("BrokenPipeError(32, 'Broken pipe')", "unexpected BrokenPipeError"),
        ("ValueError('x' * 100_000)", "unexpected ValueError"),
    ],
)
def test_what_nobody_thought_of_is_a_sentence_and_a_file(error: str, words: str, tmp_path: Path) -> None:
    done = ran(BREAKS.format(error=error), capture_output=True, env={**os.environ, "TMPDIR": str(tmp_path)})
    assert done.returncode == 3
    sentence = done.stderr.strip().splitlines()[-1]
    assert sentence.startswith(f"taskslam: {words}")
    assert len(sentence) < 1000
    (file,) = tmp_path.iterdir()
    assert sentence.endswith(f"the traceback is in {file}")
    assert "in broken" in file.read_text()


def test_where_no_file_can_be_written_the_traceback_is_printed(tmp_path: Path) -> None:
    limited = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))\n"
    done = ran(limited + BREAKS.format(error="RuntimeError('x')"), capture_output=True, env=os.environ)
    assert done.returncode == 3
    assert "Traceback" in done.stderr
    assert "no file can be written" in done.stderr.splitlines()[-1]


def test_results_that_cannot_be_written_are_infrastructure() -> None:
    with Path("/dev/full").open("w") as full:
        done = ran(MAIN, "planners", "list", stdout=full, stderr=subprocess.PIPE)
    assert (done.returncode, done.stderr) == (
        3,
        "taskslam: standard output: cannot be written: No space left on device\n",
    )
    reading, writing = os.pipe()
    os.close(reading)
    done = ran(MAIN, "--help", stdout=writing, stderr=subprocess.PIPE)
    os.close(writing)
    assert (done.returncode, done.stderr) == (3, "taskslam: standard output: cannot be written: Broken pipe\n")


def test_remarks_that_cannot_be_written_change_nothing() -> None:
    with Path("/dev/full").open("w") as full:
        assert ran(MAIN, "evaluate", "/nowhere", stdout=subprocess.PIPE, stderr=full).returncode == 2


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
def test_closed_streams_are_streams_that_nobody_reads(closed: str) -> None:
    command = f'"{sys.executable}" -c "{MAIN}" planners list {closed}'
    assert subprocess.run(["sh", "-c", command], capture_output=True, timeout=60).returncode == 0


def test_a_working_folder_that_is_gone_is_named(tmp_path: Path) -> None:
    code = f"import os; os.chdir({str(tmp_path)!r}); os.mkdir('gone'); os.chdir('gone'); os.rmdir('../gone')\n"
    done = ran(code + MAIN, "doctor", capture_output=True)
    assert done.returncode == 3
    assert done.stderr == "taskslam: the working folder cannot be used: No such file or directory; go to another one\n"


def test_little_address_space_is_infrastructure() -> None:
    limited = "import resource; resource.setrlimit(resource.RLIMIT_AS, (200 << 20, 200 << 20))\n"
    done = ran(limited + MAIN, "evaluate", "/nowhere", capture_output=True)
    assert done.returncode == 3
    assert done.stderr.startswith("taskslam: out of memory: this process may have 200 MiB of address space")


WAITS = """
import time
from taskslam.cli import app
from taskslam.stopping import StoppedError
def waits():
    print("ready", flush=True)
    try:
        time.sleep(60)
    finally:
        time.sleep(0.5)
        print("put away", flush=True)
app.app.command("waits")(waits)
import sys
sys.argv[1:] = ["waits"]
from taskslam.cli.main import main
main()
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_with_words_and_its_status_after_putting_away(number: signal.Signals) -> None:
    process = subprocess.Popen([sys.executable, "-c", WAITS], text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    time.sleep(0.2)  # it waits by now
    process.send_signal(number)
    time.sleep(0.2)
    process.send_signal(signal.SIGTERM)  # a second one, as of a parent after a terminal
    out, err = process.communicate(timeout=30)
    assert (process.returncode, out, err) == (
        128 + number,
        "put away\n",
        f"taskslam: stopped by {number.name}; what is finished is kept, start again to go on\n",
    )


def test_a_signal_that_was_ignored_stays_ignored() -> None:
    """As under nohup."""
    code = "import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN)\n" + WAITS.replace("60", "1")
    process = subprocess.Popen([sys.executable, "-c", code], text=True, stdout=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGHUP)
    assert process.communicate(timeout=30)[0] == "put away\n"
    assert process.returncode == 0


@pytest.mark.parametrize("place", ["absent", "full", "damaged"])
def test_compiled_loops_need_no_cache(place: str, tmp_path: Path) -> None:
    code = "from taskslam.simulation.drive import ramp; print(ramp(0.0, 1.0, 0.25))"
    folder = "/proc/nowhere" if place == "absent" else str(tmp_path)
    environment = {**os.environ, "NUMBA_CACHE_DIR": folder}
    if place == "damaged":
        ran(code, capture_output=True, env=environment)
        files = [path for path in tmp_path.rglob("*") if path.is_file()]
        assert files
        for file in files:
            file.write_bytes(file.read_bytes()[:-20])
    if place == "full":
        code = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (20, 20))\n" + code
    done = ran(code, capture_output=True, env=environment)
    assert (done.returncode, done.stdout) == (0, "0.25\n"), done.stderr
