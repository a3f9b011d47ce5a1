"""Adversaries in the loop: methods of `guests/`, short tours, and what is left when they have gone.

`make torture` (TASKSLAM_TORTURE=1) tries every act at every place, and more often; the test command a part of them.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest


@pytest.fixture
def guests(monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of adversaries, importable in the child."""
    folder = Path(__file__).parent / "guests"
    monkeypatch.syspath_prepend(str(folder))
    return folder


@pytest.fixture
def own_temporary_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder for temporary files that no other test uses."""
    folder = tmp_path / "tmp"
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr(tempfile, "tempdir", None)
    yield folder
    tempfile.tempdir = None
