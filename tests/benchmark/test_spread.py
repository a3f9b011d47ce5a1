"""The runs of a study of spread: what is held is held, and no two of them stand in one folder."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from taskslam.benchmark.spec import run_folder
from taskslam.benchmark.spread import EVERYTHING, METHOD_SEED, NOISE, THREADS, spread_runs
from taskslam.benchmark.stage import Stage
from taskslam.mode import Mode


def test_each_source_is_held_in_turn(make_stage: Callable[..., Stage]) -> None:
    runs = spread_runs(make_stage().spec("gf_gg", Mode.WITHOUT_MAP), runs=6, groups=2, seed_option="seed")
    assert Counter(run.part for run in runs) == {EVERYTHING: 6, NOISE: 6, METHOD_SEED: 6, THREADS: 6}
    for part, varied in ((NOISE, (1, 3)), (METHOD_SEED, (3, 1)), (THREADS, (1, 1))):
        for group in (0, 1):
            own = [run.spec for run in runs if (run.part, run.group) == (part, group)]
            assert (len({spec.seed for spec in own}), len({spec.options["seed"] for spec in own})) == varied
    folders = [run_folder(Path(run.folder), run.spec) for run in runs]
    assert len(set(folders)) == len(runs)


def test_without_a_seed_of_its_own_a_method_differs_by_noise_and_threads(make_stage: Callable[..., Stage]) -> None:
    runs = spread_runs(make_stage().spec("orb_slam3", Mode.WITHOUT_MAP), runs=4)
    assert {run.part for run in runs} == {EVERYTHING, NOISE, THREADS}
    same = [{(run.folder, run.spec.seed) for run in runs if run.part == part} for part in (NOISE, THREADS)]
    assert same[0] == same[1]  # what holds the noise is the very same run again: driven once, read twice
    with pytest.raises(ValueError, match="at least two"):
        spread_runs(make_stage().spec("orb_slam3", Mode.WITHOUT_MAP), runs=3, groups=2)
