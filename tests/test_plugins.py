"""Registered names come from the installed packages, in order of the search path, and nothing is imported for them."""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from taskslam.plugins import registered


def test_names_are_sorted_and_the_first_of_two_counts(
    tmp_path: Path, register: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    near, far = tmp_path / "near", tmp_path / "far"
    register(near, "near", "1.0", {"a.group": {"zebra": "near:zebra", "ant": "near:ant"}})
    register(far, "far", "1.0", {"a.group": {"ant": "far:ant", "bee": "far:bee"}})
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
