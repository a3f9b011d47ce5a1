from pathlib import Path

import numpy as np

from taskslam.realworld.looks import Frame, Look
from taskslam.realworld.stillness import motion_px, still_runs
from taskslam.realworld.tags.detector import Tag

SECOND = 10**9


def look(second: float, x: float | None, tag: int = 1) -> Look:
    corners = np.array([[0.0, 0], [50, 0], [50, 50], [0, 50]])
    tags = () if x is None else (Tag(tag, "tag36h11", 0, 50.0, corners + np.array([x, 100.0])),)
    return Look(Frame(round(second * SECOND), Path(f"{second}.jpg")), tags)


def spans(looks: list[Look]) -> list[tuple[int, int]]:
    return [(run.first, run.last) for run in still_runs(looks)]


def test_rest_motion_rest_are_told_apart():
    looks = [look(i, x) for i, x in enumerate([100, 100.2, 100.1, 140, 180, 220, 220.3, 220.2])]
    assert spans(looks) == [(0, 2), (3, 3), (4, 4), (5, 7)]


def test_a_slow_drift_is_no_rest():
    looks = [look(i * 0.1, 100 + 0.3 * i) for i in range(20)]
    assert max(last - first for first, last in spans(looks)) <= 3


def test_a_look_without_a_tag_does_not_end_a_rest_but_a_long_gap_does():
    assert spans([look(0, 100), look(1, None), look(2, 100)]) == [(0, 2)]
    assert spans([look(0, 100), look(3, 100)]) == [(0, 0), (1, 1)]


def test_two_looks_without_a_common_tag_are_infinitely_apart():
    assert motion_px(look(0, 100, tag=1), look(1, 100, tag=2)) == float("inf")
