"""Films and recordings of a tour, read back by the libraries that others would use."""

import json

import pytest
from typer.testing import CliRunner

from small_tour import write_tour
from taskslam.cli.app import app
from taskslam.errors import InputError, RecordError
from taskslam.robot import load_robot
from taskslam.scenario import load_scenario


@pytest.fixture(scope="module")
def tour(tmp_path_factory, write_synthetic_run):
    """A run of which world and robot are at hand: three goals, trajectories, no drive."""
    folder = tmp_path_factory.mktemp("film")
    directory = write_synthetic_run(folder / "run", mode="with-map", rounds=1)
    scenario = load_scenario(str(write_tour(folder, [(2, 1, 0), (2, 2, 1)], "rounds: 1")))
    described = json.loads((directory / "run.json").read_text())
    place = scenario.model_dump(mode="json")
    described["scenario"] |= {key: place[key] for key in ("world", "floor_plan", "name")}
    described["robot"] = load_robot("turtlebot2").model_dump(mode="json")
    (directory / "run.json").write_text(json.dumps(described))
    return directory


def film(*arguments):
    return CliRunner().invoke(app, ["film", *map(str, arguments)])


def refused(kind, *arguments):
    result = film(*arguments)
    assert isinstance(result.exception, kind), result.output
    return str(result.exception)


def test_a_film_has_the_frames_that_were_asked_for(tour, tmp_path):
    encoder = pytest.importorskip("imageio_ffmpeg")
    out = tmp_path / "tour.mp4"
    result = film(tour, "--out", out, "--speed", 30, "--height", 64, "--fps", 10, "--round", "priming")
    assert result.exit_code == 0, result.exception
    assert encoder.count_frames_and_secs(str(out))[0] == 3  # 8.9 s of a round, 3 s of it a frame
    reader = encoder.read_frames(str(out))
    width, height = next(reader)["size"]
    assert height == 64 + 6
    first = next(reader)
    assert len(set(first[: 3 * width * 60])) > 20  # a picture, and not one colour
    assert [path.name for path in tmp_path.iterdir()] == ["tour.mp4"]


def test_a_gif_is_read_by_pillow(tour, tmp_path):
    pytest.importorskip("imageio_ffmpeg")
    from PIL import Image

    out = tmp_path / "tour.gif"
    assert film(tour, "--out", out, "--speed", 30, "--height", 64, "--fps", 10).exit_code == 0
    with Image.open(out) as picture:
        assert picture.n_frames == 3


def test_a_recording_holds_every_round(tour, tmp_path):
    pytest.importorskip("rerun")
    out = tmp_path / "tour.rrd"
    result = film(tour, "--out", out)
    assert result.exit_code == 0, result.exception
    content = out.read_bytes()
    assert content[:4] == b"RRF2"
    for entity in (b"map/robot", b"map/estimate", b"slam_off/metres", b"journal", b"eye"):
        assert b"/" + entity in content
    assert len(content) < 2_000_000


def test_what_cannot_be_filmed_is_refused_in_a_sentence(tour, make_run, tmp_path):
    assert "ends in .mp4, .gif or .rrd" in refused(InputError, tour, "--out", tmp_path / "tour.avi")
    sentence = refused(InputError, tour, "--out", tmp_path / "a.mp4", "--round", "2")
    assert "--round '2'; expected one of its rounds, 1 to 1 or priming" in sentence
    assert "not a run directory" in refused(RecordError, tmp_path, "--out", tmp_path / "a.mp4")
    unknown = make_run()  # its run.json names no world and describes no robot
    assert "not a run in the simulator" in refused(InputError, unknown, "--out", tmp_path / "a.mp4")
    for file in unknown.glob("round*/*.tum"):
        file.unlink()
    assert "no true trajectory of this round" in refused(InputError, unknown, "--out", tmp_path / "a.mp4")


def test_a_world_that_is_gone_is_named(tour, tmp_path):
    described = json.loads((tour / "run.json").read_text())
    described["scenario"]["world"]["file"] = "nowhere.world"
    other = tmp_path / "run"
    other.mkdir()
    for name in ("journal.jsonl", "plan.yaml", "plan.png", "round00"):
        (other / name).symlink_to(tour / name)
    (other / "run.json").write_text(json.dumps(described))
    assert "nowhere.world' was not found" in refused(
        InputError, other, "--out", tmp_path / "a.mp4", "--round", "priming"
    )
