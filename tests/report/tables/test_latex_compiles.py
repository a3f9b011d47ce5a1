"""The tables are set by LaTeX itself: they compile as they stand, and those of a preset are no wider than it says."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from taskslam.report.results import read_results
from taskslam.report.tables.layout import Layout, presets
from taskslam.report.tables.table_files import write_tables

PACKAGES = (Path(__file__).parent / "debian_packages.txt").read_text().split()
METHODS = {
    r"b_ & 5%~{c}#1\\": 0.3,
    "karto": 0.004,
    "slam_toolbox": 0.0123,
    "fast_lio2": 0.0456,
    "wheel_odometry": 0.4,
}


@pytest.fixture(scope="session")
def pdflatex() -> str:
    """Where LaTeX is; without it these tests skip, and fail in CI."""
    found = shutil.which("pdflatex")
    if found is None:
        words = f"no pdflatex: apt-get install --no-install-recommends {' '.join(PACKAGES)}"
        if os.environ.get("CI") == "true":
            pytest.fail(words)
        pytest.skip(words)
    return found


@pytest.mark.parametrize("name", ["any", "ieee-column", "ieee-wide"])
def test_tables_compile_and_fit(name: str, pdflatex: str, make_run: Callable[..., Path], tmp_path: Path) -> None:
    for index, (method, spread) in enumerate(METHODS.items()):
        for mode in ("without-map", "with-map"):
            failed = method == "slam_toolbox"
            make_run(f"{index}/{mode}", method=method, mode=mode, spread=spread, failed=failed)
    folder = tmp_path / "tables"
    write_tables(read_results([tmp_path / "results"]), folder, presets()[name] if name != "any" else Layout())
    command = [pdflatex, "-interaction=nonstopmode", "-halt-on-error", "tables.tex"]
    done = subprocess.run(command, cwd=folder, env=os.environ | {"HOME": str(tmp_path)}, check=False, timeout=300,
                          capture_output=True, text=True, errors="replace")  # fmt: skip
    assert done.returncode == 0, done.stdout[-2000:]
    assert (folder / "tables.pdf").read_bytes().startswith(b"%PDF")
    if name != "any":
        assert re.findall(r"Overfull .*", (folder / "tables.log").read_text(encoding="latin-1")) == []
