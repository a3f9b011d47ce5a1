"""A method that knows where everything is: what it tries is denied, and nothing has changed (design D12, D13)."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from adversaries.traces import LIMITS
from taskslam.geometry import SE2
from taskslam.measurements import WheelOdometry
from taskslam.processes import landlock
from taskslam.robot import load_robot
from taskslam.slam.cards import card_of
from taskslam.slam.guest.host import MethodHost

GUESTS = Path(__file__).parent / "guests"
pytestmark = pytest.mark.skipif(not landlock.is_available(), reason="this kernel has no Landlock")


@dataclass(frozen=True)
class Attacked:
    """What an attacker printed, and what the results held before and after."""

    log: str
    before: dict[str, str]
    after: dict[str, str]

    def came_of(self, verdict: str) -> list[str]:
        """The attacks that ended so."""
        return re.findall(rf"^{verdict} (.*)$", self.log, re.MULTILINE)


def content(folder: Path) -> dict[str, str]:
    """Every file of a folder with what is in it."""
    return {str(p.relative_to(folder)): p.read_text() if p.is_file() else "" for p in sorted(folder.rglob("*"))}


def attack(folder: Path, port: int, abstract: str) -> Attacked:
    """Let the attacker loose on results in `folder`, from a host that is this process."""
    results = folder / "results" / "run"
    (results / "round00").mkdir(parents=True)
    for name in ("journal.jsonl", "run.json", "round00/truth.tum"):
        (results / name).write_text("the truth")
    before = content(results)
    options = {"stluser": str(results)[::-1], "host": os.getpid(), "port": port, "abstract": abstract}
    log = folder / "method.log"
    host = MethodHost("attacker:Attacker", options, load_robot("turtlebot2").rig, log, None, LIMITS)
    with host:
        host.feed(WheelOdometry(0, SE2(), 0.0, 0.0))
        host.collect(0)
    return Attacked(log.read_text(), before, content(results))


@pytest.fixture(scope="module")
def attacked(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Attacked]:
    with pytest.MonkeyPatch.context() as patch, socket.socket() as server, socket.socket(socket.AF_UNIX) as hidden:
        patch.syspath_prepend(str(GUESTS))
        server.bind(("127.0.0.1", 0))
        server.listen()
        name = f"taskslam-test-{os.getpid()}"
        hidden.bind(f"\0{name}")
        hidden.listen()
        yield attack(tmp_path_factory.mktemp("attacked"), server.getsockname()[1], name)


def excused() -> set[str]:
    """What this kernel cannot deny, as `taskslam doctor` says; a signal to all succeeds where it reaches nobody."""
    words = {"signal to all"}
    if not landlock.closes_tcp():
        words |= {"tcp", "listen"}
    if not landlock.closes_signals():
        words |= {"abstract socket", "signal"}
    return words


def test_every_attack_is_denied(attacked: Attacked) -> None:
    assert "ATTACKED" in attacked.log
    done = [name for name in attacked.came_of("DONE") if not any(name.startswith(word) for word in excused())]
    assert done == []
    assert attacked.came_of("FAILED") == []
    assert len(attacked.came_of("DENIED")) >= 40


def test_nothing_in_the_results_has_changed(attacked: Attacked) -> None:
    assert attacked.after == attacked.before


@pytest.mark.parametrize("namespaces", [True, False], ids=["namespaces", "no_namespaces"])
def test_the_same_holds_for_a_plain_user(namespaces: bool, tmp_path: Path) -> None:
    """As a user without any privilege, who may make namespaces of his own or may not; some methods share memory."""
    script = textwrap.dedent(
        f"""
        import ctypes, os, sys
        from pathlib import Path
        if "again" not in sys.argv:
            me, group = os.getuid(), os.getgid()
            if ctypes.CDLL(None).unshare(0x10000000) != 0:
                sys.exit(77)
            maps = dict(setgroups="deny", uid_map=f"65534 {{me}} 1", gid_map=f"65534 {{group}} 1")
            for file, line in maps.items():
                Path(f"/proc/self/{{file}}").write_text(line)
            if not {namespaces}:
                Path("/proc/sys/user/max_user_namespaces").write_text("0")
            os.execv(sys.executable, [sys.executable, __file__, "again"])
        assert os.getuid() == 65534
        assert "CapEff:\t0000000000000000" in Path("/proc/self/status").read_text()
        sys.path[:0] = [{str(Path(__file__).parents[1])!r}, {str(GUESTS)!r}]
        from adversaries.test_attacks import attack, share
        found = attack(Path({str(tmp_path)!r}), 9, "nobody-listens")
        assert found.before == found.after
        print("DONE", *found.came_of("DONE"), sep="|")
        print("DENIED", len(found.came_of("DENIED")), sep="|")
        print("SHARED", share(Path({str(tmp_path)!r})), sep="|")
        """
    )
    file = tmp_path / "plain.py"
    file.write_text(script)
    environment = {**os.environ, "HOME": str(tmp_path), "TMPDIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, str(file)], capture_output=True, text=True, timeout=120, check=False, env=environment
    )
    if done.returncode == 77:
        pytest.skip("this user may make no namespace, and no other user can be had")
    assert done.returncode == 0, done.stderr
    told = dict(line.split("|", 1) for line in done.stdout.splitlines())
    assert [name for name in told["DONE"].split("|") if name not in excused()] == []
    assert int(told["DENIED"]) >= 40
    assert "locked in 2 processes" in told["SHARED"]


def share(folder: Path) -> str:
    """What a method prints that declares shared memory and uses locks of multiprocessing."""
    before = {path.name for path in Path("/dev/shm").iterdir()}
    log = folder / "shared.log"
    rig = load_robot("turtlebot2").rig
    with MethodHost("sharing:Sharing", {}, rig, log, None, LIMITS, card_of("sharing:Sharing")) as host:
        host.feed(WheelOdometry(0, SE2(), 0.0, 0.0))
        host.collect(0)
    left = {path.name for path in Path("/dev/shm").iterdir()} - before
    for name in left:
        Path("/dev/shm", name).unlink()
    return log.read_text().strip().replace("\n", " ") + f" left {sorted(left)}"


def test_a_method_that_declares_shared_memory_has_locks_and_leaves_nothing(attacked: Attacked, tmp_path: Path) -> None:
    assert share(tmp_path) == "locked in 2 processes left []"


def test_what_a_card_or_an_option_names_is_open_for_reading_only(attacked: Attacked, tmp_path: Path) -> None:
    vocabulary = tmp_path / "data" / "vocabulary.txt"
    vocabulary.parent.mkdir()
    vocabulary.write_text("words")
    (tmp_path / "results").mkdir()
    log, rig = tmp_path / "results" / "method.log", load_robot("turtlebot2").rig
    with MethodHost("sharing:Reading", {"vocabulary": str(vocabulary)}, rig, log, None, LIMITS):
        pass
    assert log.read_text().split() == ["read", "words", "denied", "13"]
    assert vocabulary.read_text() == "words"


def test_results_beside_the_methods_own_code_are_closed_and_the_code_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Somebody works in one folder: his method, what it imports, his data, the seal, and the results."""
    monkeypatch.chdir(tmp_path)
    method = GUESTS / "adversary.py"
    for source in (method, GUESTS / "acts.py"):
        (tmp_path / source.name).write_text(source.read_text())
    (tmp_path / "nosy.py").write_text(
        textwrap.dedent(
            """
            from pathlib import Path
            from adversary import Adversary
            class Nosy(Adversary):
                def start(self, rig):
                    super().start(rig)
                    for name in ("data.txt", "house/run/truth.tum", ".taskslam-seal"):
                        try:
                            print(Path(__file__).with_name("data.txt").parent.joinpath(name).read_text())
                        except OSError as error:
                            print("denied")
            """
        )
    )
    (tmp_path / "data.txt").write_text("mine")
    (tmp_path / ".taskslam-seal").write_text("secret")
    (tmp_path / "house" / "run").mkdir(parents=True)
    (tmp_path / "house" / "run" / "truth.tum").write_text("truth")
    log = tmp_path / "house" / "other" / "method.log"
    log.parent.mkdir()
    closed = (tmp_path, tmp_path / ".taskslam-seal")
    with MethodHost("nosy:Nosy", {}, load_robot("turtlebot2").rig, log, None, LIMITS, closed=closed):
        pass
    assert log.read_text().split() == ["mine", "denied", "denied"]
