from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from taskslam.errors import DetectorError, InputError
from taskslam.realworld.cameras.images import read_grey
from taskslam.realworld.tags.detector import Detector
from taskslam.realworld.tags.tag_family import code_cells

pytest.importorskip("apriltag")


def picture(*tags: tuple[int, int, int]) -> np.ndarray:
    image = np.full((240, 480), 220, np.uint8)
    for number, x, y in tags:
        image[y : y + 80, x : x + 80] = np.kron(code_cells("tag36h11", number), np.ones((10, 10))) * 200 + 20
    return image


def test_only_the_ids_asked_for_are_reported() -> None:
    with Detector(ids=[4, 9]) as detector:
        assert [tag.id for tag in detector.detect(picture((9, 20, 20), (3, 140, 20), (4, 260, 20)))] == [4, 9]


def test_a_child_killed_between_images_is_replaced() -> None:
    with Detector() as detector:
        detector.detect(picture())
        assert detector.pid is not None
        os.kill(detector.pid, signal.SIGKILL)
        assert [tag.id for tag in detector.detect(picture((7, 100, 100)), "b.jpg")] == [7]


def dies(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, how: str) -> None:
    """Put a detector library before the real one that ends as told when the first pixel is 66."""
    (tmp_path / "apriltag.py").write_text(
        "import os, time\n"
        "class apriltag:\n"
        "    def __init__(self, *a, **k): pass\n"
        f"    def detect(self, image):\n        if image[0, 0] == 66:\n            {how}\n        return []\n"
    )
    monkeypatch.syspath_prepend(tmp_path)


def test_an_image_over_which_the_library_dies_is_named_and_the_rest_goes_on(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    dies(monkeypatch, tmp_path, "os.kill(os.getpid(), 11)")
    bad = np.full((50, 50), 66, np.uint8)
    with Detector() as detector:
        assert detector.detect(np.zeros((50, 50), np.uint8)) == []
        with pytest.raises(DetectorError, match=r"1416\.5\.jpg.*SIGSEGV"):
            detector.detect(bad, "1416.5.jpg")
        assert detector.detect(np.zeros((50, 50), np.uint8)) == []


def test_a_detector_that_hangs_is_ended(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    dies(monkeypatch, tmp_path, "time.sleep(60)")
    with Detector(timeout_s=3.0) as detector:
        with pytest.raises(DetectorError, match=r"slow\.jpg: no answer"):
            detector.detect(np.full((50, 50), 66, np.uint8), "slow.jpg")
        assert detector.detect(np.zeros((50, 50), np.uint8)) == []


def test_the_child_ends_with_its_parent() -> None:
    code = (
        "import numpy as np, os\nfrom taskslam.realworld.tags.detector import Detector\nd = Detector()\n"
        "d.detect(np.zeros((50, 50), np.uint8))\nprint(d.pid, flush=True)\nos._exit(1)"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    status = Path(f"/proc/{int(told.stdout)}/stat")
    for _ in range(100):
        if not status.exists() or " Z " in status.read_text():
            return
        signal.sigtimedwait([], 0.05)
    pytest.fail("the detector outlived its parent")


@pytest.mark.parametrize("shape", [(0, 0), (1, 1), (3, 2000), (15, 15), (16, 16), (17, 1000)])
def test_tiny_images_hold_no_tags_and_crash_nothing(shape: tuple[int, int]) -> None:
    with Detector() as detector:
        assert detector.detect(np.zeros(shape, np.uint8)) == []


def test_wrong_images_and_settings_are_refused() -> None:
    with Detector() as detector, pytest.raises(InputError, match="expected a grey image"):
        detector.detect(np.zeros((20, 20, 3), np.uint8))
    with pytest.raises(InputError, match="maxhamming 7"):
        Detector(maxhamming=7)
    with pytest.raises(InputError, match="Did you mean 'tag36h11'"):
        Detector("tag36h1")


def test_without_the_package_the_extra_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("apriltag", "pyapriltags"):
        (tmp_path / f"{name}.py").write_text("raise ModuleNotFoundError('gone')")
    monkeypatch.syspath_prepend(tmp_path)
    with Detector() as detector, pytest.raises(InputError, match=r"pip install .*taskslam\[apriltag\]"):
        detector.detect(np.zeros((50, 50), np.uint8))


def reference(file: Path) -> list[tuple[int, np.ndarray]]:
    rows = [[float(x) for x in re.findall(r"-?[\d.]+", line)] for line in file.read_text().splitlines()]
    # The library's own files count pixels from the outer corner of the first one.
    return [(int(row[0]), np.array(row[1:]).reshape(4, 2) - 0.5) for row in rows if row]


def same_square(one: np.ndarray, other: np.ndarray) -> float:
    turns = [np.roll(order, turn, 0) for order in (other, other[::-1]) for turn in range(4)]
    return min(float(np.abs(one - turned).max()) for turned in turns)


def test_all_reference_detections_in_the_real_photographs_are_found(data: Path) -> None:
    found = total = 0
    with Detector(maxhamming=2, refine_edges=False) as detector:
        for file in sorted((data / "apriltag").glob("*.txt")):
            if file.with_suffix(".jpg").exists():
                tags = detector.detect(read_grey(file.with_suffix(".jpg")))
                expected = reference(file)
                total += len(expected)
                for number, corners in expected:
                    found += any(tag.id == number and same_square(corners, tag.corners) < 0.15 for tag in tags)
                assert len(tags) == len(expected)
    assert (found, total) == (47, 47)
