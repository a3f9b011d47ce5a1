"""What a run shows while it is driven is small, whole or passed over, and no part of its result."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from taskslam.geometry import SE2
from taskslam.record import RunWriter, load_run
from taskslam.record.newest import MOST_SHOWN, NEWEST, Newest, newest_state, read_newest, write_newest

SCAN = np.column_stack([np.linspace(0, 4, 1000), np.full(1000, 1 / 3)])


def state() -> Newest:
    return newest_state(5, 0, SE2(1.0, 2.0, 0.5), None, SCAN)


def test_a_run_under_way_shows_where_it_is_and_a_finished_one_keeps_nothing_of_it(
    tmp_path: Path, manifest: dict[str, Any]
) -> None:
    asked = []
    with RunWriter(tmp_path / "run") as run:
        for step in range(5000):
            run.pose("truth", 0, step, SE2(step / 1000, 0.0, 0.0))
            run.show(lambda: asked.append(1) or state())
        shown = read_newest(run.folder)
        run.finish(manifest)
    assert shown is not None
    assert (shown.truth, shown.estimate) == ((1.0, 2.0, 0.5), None)
    assert len(shown.scan) <= MOST_SHOWN
    assert shown.scan[-1] == (4.0, 0.333)
    assert 0 < len(shown.way) <= MOST_SHOWN
    assert len(asked) < 5000  # not at every beat of the loop
    assert not list(tmp_path.rglob(f"*{NEWEST}*"))
    assert load_run(tmp_path / "run", damaged=True).changed == ()


def test_who_was_replaced_shows_nothing(tmp_path: Path) -> None:
    first = RunWriter(tmp_path / "run", spec="the spec")
    RunWriter(tmp_path / "run", spec="the spec", take_over=True)
    first.show(state)
    assert read_newest(first.folder) is None


def test_that_nothing_can_be_shown_ends_no_run(tmp_path: Path) -> None:
    write_newest(tmp_path / "nowhere", state())
    (tmp_path / NEWEST).symlink_to(tmp_path / "elsewhere")
    write_newest(tmp_path, state())
    assert not (tmp_path / "elsewhere").exists()


@pytest.mark.parametrize("cut", [0, 1, 40, -1])
def test_half_a_state_is_none(tmp_path: Path, cut: int) -> None:
    write_newest(tmp_path, state())
    assert read_newest(tmp_path) is not None
    whole = (tmp_path / NEWEST).read_bytes()
    (tmp_path / NEWEST).write_bytes(whole[:cut])
    assert read_newest(tmp_path) is None
    assert read_newest(tmp_path / "nowhere") is None
