"""The five commands from a map to a report, as they stand on the page."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np

from taskslam.geometry import SE2
from taskslam.world.floor_plan import FREE, OCCUPIED, UNKNOWN, FloorPlan
from taskslam.world.map_server import save_floor_plan

PAGE = Path(__file__).parents[2] / "docs" / "your_place.md"


def test_five_commands_lead_from_a_map_to_a_report(tmp_path: Path) -> None:
    cells = np.full((110, 150), UNKNOWN, np.uint8)  # two rooms of a map as SLAM leaves it
    cells[10:100, 10:140] = OCCUPIED
    cells[12:98, 12:138] = FREE
    cells[12:45, 70:73] = OCCUPIED
    cells[65:98, 70:73] = OCCUPIED
    cells[30:38, 30:44] = OCCUPIED
    save_floor_plan(FloorPlan(cells, 0.05, SE2(-2.0, -3.0, 0.1)), tmp_path / "my_map.yaml")
    (script,) = re.findall(r"^```bash\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert script.count("taskslam ") == 5
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", "-euxc", script], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]
    assert re.search(r"6 goals, \d+\.\d m of way a round, each 50 cm or more clear", done.stdout)
    runs = json.loads((tmp_path / "results" / "metrics.json").read_text(encoding="utf-8"))["runs"]
    assert [(run["completeness"], run["rounds"]) for run in runs] == [(1.0, 3), (1.0, 3)]
    assert "walls" in (tmp_path / "office.yaml").read_text(encoding="utf-8")
    assert (tmp_path / "report.html").stat().st_size > 10_000
    assert (tmp_path / "preview.html").stat().st_size > 10_000
