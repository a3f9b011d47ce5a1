"""The guard of ORB-SLAM3's motion between two views. Skipped where pyorbslam3 is not installed.

Each case has a process of its own, because ORB-SLAM3 ends it where the guard does not hold.
"""

import importlib.util
import subprocess
import sys

import pytest

from taskslam.slam.orb.equal_views import EqualViews

needs_package = pytest.mark.skipif(
    importlib.util.find_spec("pyorbslam3") is None, reason="pyorbslam3 is not installed (extra 'orb-slam3')"
)
CHILD = """
import ctypes, importlib.util, math, sys
from pathlib import Path
import numpy as np
from taskslam.slam.orb.equal_views import EqualViews

folder = Path(importlib.util.find_spec("pyorbslam3").origin).parent
views = EqualViews(next(folder.glob("_core*.so")))
solver = ctypes.create_string_buffer(4096)
nan = math.nan
floats = lambda points: points.ctypes.data_as(ctypes.POINTER(ctypes.c_float))
first, second = (np.array(points, np.float32) for points in eval(sys.argv[2]))
before = second.copy()
getattr(views, sys.argv[1])(ctypes.addressof(solver), floats(first), floats(second))
print(views.happened, (second == before).all())
"""
TRIANGLE = [[1, 2, 5], [3, -1, 4], [0.5, 0.2, 7]]
TURNED = [[-2, 1, 5], [1, 3, 4], [-0.2, 0.5, 7]]
DOT, OTHER_DOT, NOTHING = [[1, 2, 5]] * 3, [[1.1, 2.3, 5.7]] * 3, [[float("nan")] * 3] * 3
LINE = [[1, 1, 1], [2, 2, 2], [3, 3, 3]]


def computed(function, first, second):
    command = [sys.executable, "-c", CHILD, function, repr((first, second))]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


@needs_package
def test_orb_slam3_itself_ends_its_process_between_three_points_and_themselves():
    """If it no longer does, the guard can go."""
    done = computed("original", TRIANGLE, TRIANGLE)
    assert done.returncode < 0
    assert "SO3::exp failed" in done.stdout + done.stderr


@needs_package
@pytest.mark.parametrize(
    ("first", "second"),
    [(TRIANGLE, TRIANGLE), (LINE, LINE), (DOT, DOT), (DOT, TRIANGLE), (DOT, OTHER_DOT), (NOTHING, NOTHING)],
)
def test_points_without_a_rotation_do_not_end_the_process(first, second):
    done = computed("guarded", first, second)
    assert done.returncode == 0
    assert done.stdout.startswith("1 ")


@needs_package
def test_views_that_differ_are_left_as_they_are():
    assert computed("guarded", TRIANGLE, TURNED).stdout.split() == ["0", "True"]


@pytest.mark.parametrize("content", [b"", b"\x7fELF", b"\x7fELF" + bytes(200)])
def test_another_library_is_refused(tmp_path, content):
    (tmp_path / "other.so").write_bytes(content)
    with pytest.raises(ValueError, match=r"no such slot|not a library"):
        EqualViews(tmp_path / "other.so")
