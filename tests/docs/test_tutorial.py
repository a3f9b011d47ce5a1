"""The tutorial's commands, run as they stand on the page, in order, in an empty folder."""

import os
import re
import subprocess
import sys
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"
BLOCK = re.compile(r"^```(bash|python)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_the_tutorial_works_as_it_stands(tmp_path):
    page = (DOCS / "tutorial.md").read_text(encoding="utf-8")
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    script = []
    for language, text in BLOCK.findall(page):
        if language == "python":
            (name,) = re.findall(r"Save this as `(\w+\.py)`", page)
            (tmp_path / name).write_text(text, encoding="utf-8")
        else:
            script.append(text)
    assert len(script) >= 4
    done = subprocess.run(
        ["bash", "-euxc", "\n".join(script)], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=900
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]
    assert (tmp_path / "report.html").stat().st_size > 10_000
    assert list((tmp_path / "figures").glob("*.pdf"))
    assert "karto" in (tmp_path / "summary.md").read_text(encoding="utf-8")
