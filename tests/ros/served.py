"""Served robots in processes of their own, as `taskslam serve` starts them."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

from taskslam.record.journal import read_journal
from taskslam.record.served import EVENTS, SERVED


class Served:
    """`stop` is a Ctrl-C; whatever it said on standard error is then in `said`."""

    def __init__(self, scenario: Path, out: Path, *words: str) -> None:
        self.out = out
        main = "from taskslam.cli.main import main; main()"
        command = [
            sys.executable,
            "-c",
            main,
            "serve",
            str(scenario),
            "--out",
            str(out),
            "--quiet",
            "--wait",
            "60",
            *words,
        ]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        while not (out / SERVED).exists():
            assert self.process.poll() is None, self.process.communicate()[1]
            time.sleep(0.02)
        self.variables: dict[str, str] = json.loads((out / SERVED).read_text())["variables"]

    @property
    def where(self) -> str:
        """As `join_graph` takes it."""
        return next(iter(self.variables.values()))

    def notices(self) -> list[str]:
        return [event.text for event in read_journal(self.out / EVENTS).events if hasattr(event, "text")]

    def stop(self, number: int = signal.SIGINT) -> int:
        if self.process.poll() is None:
            self.process.send_signal(number)
        _, self.said = self.process.communicate(timeout=60)
        return self.process.returncode
