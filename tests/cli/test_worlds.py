import pytest
from PIL import Image
from typer.testing import CliRunner

from taskslam.cli.worlds import app
from taskslam.errors import InputError, WorldError

WORLD = """<sdf version='1.6'><world name='w'><light name='sun' type='directional'/>
<include><uri>model://lost</uri></include>
<model name='crate'><link name='l'><visual name='v'><geometry><box><size>2 3 1</size></box></geometry></visual>
<collision name='c'><geometry><box><size>2 3 1</size></box></geometry></collision></link></model></world></sdf>"""


@pytest.fixture
def invoke(monkeypatch, tmp_path):
    monkeypatch.setenv("TASKSLAM_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("COLUMNS", "200")

    def run(*arguments):
        return CliRunner().invoke(app, [str(a) for a in arguments], catch_exceptions=False)

    return run


@pytest.fixture
def world_file(tmp_path):
    path = tmp_path / "yard.world"
    path.write_text(WORLD)
    return path


def test_list_names_the_built_in_world(invoke):
    result = invoke("list")
    assert result.exit_code == 0
    assert "house" in result.output


def test_show_tells_what_is_in_a_world(invoke, world_file):
    output = invoke("show", world_file).output
    for text in ("yard", "2.0 x 3.0 x 1.0 m", "12 visual, 12 collision", "1 directional", "1 model: lost"):
        assert text in output


def test_import_fills_the_cache_and_says_where(invoke, world_file, tmp_path):
    result = invoke("import", world_file)
    assert result.exit_code == 0
    (cached,) = (tmp_path / "cache" / "worlds").glob("yard-*.npz")
    assert cached.name in result.output
    assert "Loaded in" in result.output
    cached.write_bytes(b"damaged")
    assert invoke("import", "--fresh", world_file).exit_code == 0
    assert cached.stat().st_size > 1000


def test_render_writes_two_pictures(invoke, world_file, tmp_path):
    result = invoke("render", world_file, "--out", tmp_path / "a" / "b", "--pose=-4,0,0", "--size", 64)
    assert result.exit_code == 0
    with Image.open(tmp_path / "a" / "b" / "top_down.png") as top:
        assert max(top.size) == 64
    with Image.open(tmp_path / "a" / "b" / "perspective.png") as view:
        assert view.size == (64, 36)
        assert len(view.getcolors()) > 10


def test_unknown_world_and_missing_file_are_errors(invoke, tmp_path):
    with pytest.raises(WorldError, match="Did you mean 'house'"):
        invoke("show", "hose")
    with pytest.raises(WorldError, match="does not exist"):
        invoke("import", tmp_path / "none.world")


@pytest.mark.parametrize("pose", ["1,2", "a,b,c", "1,2,nan", "1,2,3,4"])
def test_pose_that_is_not_three_numbers_is_told(invoke, world_file, pose):
    with pytest.raises(InputError, match=f"--pose is '{pose}'; expected x,y,yaw"):
        invoke("render", world_file, "--pose", pose)


def test_folder_that_cannot_be_written_is_told(invoke, world_file, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="Pictures cannot be written"):
        invoke("render", world_file, "--out", tmp_path / "file" / "x", "--size", 16)
