"""A method that is told where everything is, as no method ever is, and tries to reach it; it prints what came of it."""

import ctypes
import os
import signal
import socket
from pathlib import Path

from adversary import Adversary


def attempt(name, attack):
    try:
        attack()
    except OSError as error:
        print("DENIED", name, error.errno, flush=True)
    except Exception as error:
        print("FAILED", name, type(error).__name__, error, flush=True)
    else:
        print("DONE", name, flush=True)


def system(name, *arguments):
    """A call of the C library that must succeed."""
    if getattr(ctypes.CDLL(None, use_errno=True), name)(*arguments) < 0:
        raise OSError(ctypes.get_errno(), name)


def write(path, mode="w"):
    with open(path, mode) as file:
        file.write("owned")


def send(kind, address):
    with socket.socket(*kind) as sock:
        sock.settimeout(0.5)
        sock.connect(address)


class Attacker(Adversary):
    def __init__(self, stluser: str, host: int, port: int, abstract: str) -> None:
        super().__init__()
        self.results, self.host, self.port, self.abstract = Path(stluser[::-1]), host, port, abstract

    def start(self, rig):
        super().start(rig)
        results, host = self.results, self.host
        journal, finished = results / "journal.jsonl", results / "run.json"
        planted = Path("planted")
        attempt("read", journal.read_text)
        attempt("list", lambda: os.listdir(results))
        attempt("truncate", lambda: os.truncate(journal, 0))
        attempt("append", lambda: write(journal, "a"))
        attempt("overwrite", lambda: write(finished))
        attempt("create", lambda: write(results / "new"))
        attempt("unlink", journal.unlink)
        attempt("rename away", lambda: os.rename(finished, "mine"))
        attempt("rename within", lambda: os.rename(finished, results / "other"))
        attempt("hard link out", lambda: os.link(journal, "journal"))
        attempt("hard link in", lambda: (write(planted), os.link(planted, results / "in")))
        attempt("symlink in", lambda: os.symlink("/etc/passwd", results / "link"))
        attempt("mkdir", lambda: os.mkdir(results / "folder"))
        attempt("rmdir", lambda: os.rmdir(results / "round00"))
        attempt("fifo", lambda: os.mkfifo(results / "pipe"))
        attempt("socket", lambda: socket.socket(socket.AF_UNIX).bind(str(results / "socket")))
        attempt("read through a link", lambda: (os.symlink(journal, "way"), Path("way").read_text()))
        attempt("write through a link", lambda: (os.symlink(finished, "way2"), write("way2")))
        for place in ("/tmp", "/var/tmp", "/dev/shm", str(Path(__file__).parent), os.path.dirname(os.__file__)):
            attempt(f"write in {place}", lambda place=place: write(f"{place}/taskslam-owned"))
        attempt("home", lambda: write(Path.home().parent / "owned"))
        attempt("read the password file", Path("/etc/passwd").read_text)
        attempt("read the host's command line", Path(f"/proc/{host}/cmdline").read_bytes)
        attempt("read the supervisor's command line", Path(f"/proc/{os.getppid()}/cmdline").read_bytes)
        attempt("read the host's memory", lambda: open(f"/proc/{host}/mem", "rb"))
        attempt("list processes", lambda: os.listdir("/proc"))
        for number in (signal.SIGSTOP, signal.SIGTERM, signal.SIGKILL, 0):
            attempt(f"signal {number} to the host", lambda number=number: os.kill(host, number))
            attempt(f"signal {number} to the supervisor", lambda number=number: os.kill(os.getppid(), number))
        attempt("signal to all", lambda: os.kill(-1, signal.SIGSTOP))
        attempt("trace the host", lambda: system("ptrace", 16, host, 0, 0))
        attempt("trace the supervisor", lambda: system("ptrace", 16, os.getppid(), 0, 0))
        attempt("mount", lambda: system("mount", b"none", b"/tmp", b"tmpfs", 0, None))
        attempt("change root", lambda: os.chroot("."))
        attempt("tcp", lambda: send((socket.AF_INET, socket.SOCK_STREAM), ("127.0.0.1", self.port)))
        attempt("listen", lambda: socket.socket(socket.AF_INET).bind(("127.0.0.1", 0)))
        attempt("abstract socket", lambda: send((socket.AF_UNIX, socket.SOCK_STREAM), f"\0{self.abstract}"))
        attempt("device", lambda: os.open("/dev/tty", os.O_RDWR))
        print("ATTACKED", flush=True)
