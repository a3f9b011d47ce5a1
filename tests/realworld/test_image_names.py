from pathlib import Path

import pytest

from taskslam.errors import InputError
from taskslam.realworld.looks import image_frames

SECOND = 1_000_000_000
START = 1_716_393_934


def stamps(folder: Path, *names: str) -> list[int]:
    for name in names:
        (folder / f"{name}.png").touch()
    return [frame.stamp for frame in image_frames(folder)]


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["1716393934.25", "1716393934.5"], [0.25, 0.5]),
        (["1716393934.250000", "1716393934.316428"], [0.25, 0.316428]),  # TUM RGB-D
        (["1716393934", "1716393935"], [0, 1]),
        (["east_1716393934.000000001", "east_1716393934.9"], [1e-9, 0.9]),
        (["1716393934_1000000", "1716393934_51000000", "1716393934_101000000"], [0.001, 0.051, 0.101]),
        (["1716393934_001000000", "1716393934_051000000"], [0.001, 0.051]),
        (["1716393934.1000000", "1716393934.51000000", "1716393934.101000000"], [0.001, 0.051, 0.101]),
        (["1716393934250000000", "1716393935250000000"], [0.25, 1.25]),
        (["1716393934250000", "1716393934300000"], [0.25, 0.3]),
        (["1716393934250", "1716393934300"], [0.25, 0.3]),
    ],
)
def test_a_name_ends_in_its_time(tmp_path: Path, names: list[str], expected: list[float]) -> None:
    assert stamps(tmp_path, *names) == [START * SECOND + round(after * SECOND) for after in expected]


def test_a_name_without_a_time_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the name ends in no time; expected Unix seconds such as"):
        stamps(tmp_path, "1716393934.25", "overview")
