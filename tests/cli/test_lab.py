import pytest

from taskslam.cli.lab import lab
from taskslam.errors import InputError, RecordError


@pytest.mark.parametrize(
    ("name", "error", "message"),
    [
        ("house_camera", InputError, "Did you mean 'house_cameras'?"),
        ("house_cameras", RecordError, "not a run directory; expected a folder"),
    ],
)
def test_what_is_missing_is_named_before_anything_is_written(tmp_path, name, error, message):
    with pytest.raises(error) as caught:
        lab(tmp_path, name, tmp_path / "out", quiet=True)
    assert message in str(caught.value)
    assert not (tmp_path / "out").exists()
