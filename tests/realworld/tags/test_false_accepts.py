"""The short version of benchmarks/tag_false_accepts.py."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

pytest.importorskip("apriltag")


def test_no_tag_is_accepted_wrongly_and_good_ones_are(monkeypatch: pytest.MonkeyPatch) -> None:
    file = Path(__file__).parents[3] / "benchmarks" / "tag_false_accepts.py"
    spec = importlib.util.spec_from_file_location("tag_false_accepts", file)
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, script)
    spec.loader.exec_module(script)
    counted = script.count(cases=12, seed=1)
    assert {kind: wrong for kind, (_, _, wrong) in counted.items()} == dict.fromkeys(script.KINDS, 0)
    assert counted["good"][1] == 12
    assert sum(found for kind, (found, _, _) in counted.items() if kind != "good") > 10  # the cases are hard, not empty
