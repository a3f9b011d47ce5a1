"""Registered names come from the installed packages, in order of the search path, and nothing is imported for them."""

import sys
from pathlib import Path

import pytest

from taskslam.plugins import registered


def install(folder: Path, package: str, *lines: str) -> Path:
    info = folder / f"{package}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("\n".join(["[a.group]", *lines]))
    return folder


def test_names_are_sorted_and_the_first_of_two_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    near = install(tmp_path / "near", "near", "zebra = near:zebra", "ant = near:ant")
    far = install(tmp_path / "far", "far", "ant = far:ant", "bee = far:bee")
    monkeypatch.setattr(sys, "path", [str(near), str(far), *sys.path])
    found = registered("a.group")
    assert [(name, entry.value) for name, entry in found.items()] == [
        ("ant", "near:ant"),
        ("bee", "far:bee"),
        ("zebra", "near:zebra"),
    ]
    assert "near" not in sys.modules


def test_a_group_that_nobody_fills_is_empty() -> None:
    assert registered("a.group.of.nobody") == {}
