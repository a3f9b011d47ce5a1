"""A little of `make torture`: it runs for minutes, this for a few starts of one short run."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

TOOL = Path(__file__).parents[1] / "tools" / "torture.py"


def test_a_campaign_that_is_killed_loses_nothing() -> None:
    command = [sys.executable, str(TOOL), "--kills", "1", "--small", "--seed", "3"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.startswith("1 kills: ")
    assert done.stdout.endswith("Nothing was lost.\n")
