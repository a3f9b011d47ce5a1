"""The tour on a served robot, run as it stands on its page, in an empty folder."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"
BLOCK = re.compile(r"^```(bash|yaml)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_the_page_works_as_it_stands(tmp_path):
    page = (DOCS / "robot_tour.md").read_text(encoding="utf-8")
    blocks = BLOCK.findall(page)
    files = re.findall(r"`(\w+\.yaml)`", page)
    written = [text for language, text in blocks if language == "yaml"]
    for name, text in zip(("goals.yaml", "corridor.yaml", "my_robot.yaml"), written, strict=True):
        assert name in files
        (tmp_path / name).write_text(text, encoding="utf-8")
    script = "\n".join(text for language, text in blocks if language == "bash")
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", "-euxc", script], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300,
        stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]
    assert "corridor · karto · without-map: the robot is ready" in done.stdout
    metrics = json.loads((tmp_path / "measured" / "metrics.json").read_text())
    (run,) = metrics["runs"]
    assert run["completeness"] == 1.0
    assert 0.0 < run["position"]["precision_m"] < 0.1


def test_the_connection_of_the_page_is_one():
    from taskslam.errors import InputError
    from taskslam.ros.connection import Connection
    from taskslam.user_files import check, mapping_of

    text = next(text for _, text in BLOCK.findall((DOCS / "robot_tour.md").read_text()) if "limits:" in text)
    connection = check(Connection, mapping_of(text, "page", InputError, ""), "page", InputError)
    assert connection.theirs("/scan") == "/front/scan"
