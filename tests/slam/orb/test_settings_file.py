import math

import pytest
import yaml

from taskslam.robot import load_robot
from taskslam.slam.orb.settings_file import OrbSettings, write_settings


@pytest.fixture
def written(tmp_path):
    def write(settings=OrbSettings()):  # noqa: B008 - frozen
        camera = load_robot("turtlebot2").rig.stereo
        write_settings(tmp_path / "orb.yaml", camera, settings)
        first, _, rest = (tmp_path / "orb.yaml").read_text().partition("\n")
        assert first == "%YAML:1.0"  # OpenCV's header, which YAML's own parsers refuse
        return yaml.safe_load(rest)

    return write


def test_the_published_camera_gives_the_published_settings(written):
    values = written()
    assert values["Camera.fx"] == values["Camera.fy"] == pytest.approx(360.06528871, abs=1e-4)
    assert (values["Camera.cx"], values["Camera.cy"]) == (376.0, 240.0)
    assert values["Camera.bf"] == pytest.approx(39.6071817581, abs=1e-4)
    assert values["ThDepth"] == 35.0
    assert [values[f"ORBextractor.{key}"] for key in ("nFeatures", "nLevels", "iniThFAST", "minThFAST")] == [
        800,
        8,
        20,
        7,
    ]
    assert math.isclose(values["ORBextractor.scaleFactor"], 1.2)


def test_reals_are_written_as_reals_and_counts_as_counts(written):
    for key, value in written(OrbSettings(features=500, close_depth=40)).items():
        whole = key.startswith("ORBextractor") and key != "ORBextractor.scaleFactor"
        whole |= key in ("Camera.width", "Camera.height", "Camera.RGB")
        assert isinstance(value, str if key == "Camera.type" else int if whole else float), key


@pytest.mark.parametrize(
    "options",
    [{"features": 10}, {"fast_threshold": 5}, {"lowest_fast_threshold": 0}, {"close_depth": float("nan")}],
    ids=lambda options: next(iter(options)),
)
def test_settings_out_of_range_are_refused(options):
    with pytest.raises(ValueError, match=next(iter(options))):
        OrbSettings(**options)
