import dataclasses
import os
from importlib.metadata import EntryPoint

import numpy as np
import pytest

from taskslam.errors import WorldError
from taskslam.files import cache_folder
from taskslam.world import loading
from taskslam.world.loading import load_world


def assert_same(a, b):
    for kind in ("visual", "collision"):
        for field in dataclasses.fields(a.visual):
            one, two = getattr(getattr(a, kind), field.name), getattr(getattr(b, kind), field.name)
            assert one.dtype == two.dtype
            assert one.tobytes() == two.tobytes()
    assert [dataclasses.replace(m, texture=None) for m in a.materials] == [
        dataclasses.replace(m, texture=None) for m in b.materials
    ]
    for one, two in zip(a.materials, b.materials, strict=True):
        assert (one.texture is None) == (two.texture is None)
        assert one.texture is None or np.array_equal(one.texture, two.texture)
    for one, two in zip(a.lights, b.lights, strict=True):
        assert np.array_equal(one.pose, two.pose)
        assert dataclasses.replace(one, pose=None) == dataclasses.replace(two, pose=None)
    assert (a.name, a.models, a.ambient, a.background, a.warnings) == (
        b.name,
        b.models,
        b.ambient,
        b.background,
        b.warnings,
    )


@pytest.fixture
def textured_world(site, make_dae, make_png):
    site.file("models/thing/meshes/a.dae", make_dae(image="skin.png"))
    site.file("models/thing/meshes/skin.png", make_png((1, 2, 3)))
    mesh = "<geometry><mesh><uri>model://thing/meshes/a.dae</uri></mesh></geometry>"
    site.model("thing", f"<link name='l'><visual name='v'>{mesh}</visual><collision name='c'>{mesh}</collision></link>")
    lamp = "<light name='lamp' type='point'><pose>1 2 3 0 0 0</pose></light>"
    return site.world(f"<include><uri>model://thing</uri></include><include><uri>model://lost</uri></include>{lamp}")


@pytest.fixture
def imports(monkeypatch):
    """Counts how often a world is really imported."""
    count = []
    real = loading._import
    monkeypatch.setattr(loading, "_import", lambda *arguments: count.append(1) or real(*arguments))
    return count


def test_cached_world_is_the_same_to_the_last_byte(textured_world, imports):
    first, second = load_world(textured_world), load_world(textured_world)
    assert len(imports) == 1
    assert_same(first, second)
    assert_same(first, load_world(textured_world, use_cache=False))


@pytest.mark.parametrize("changed", ["worlds/test.world", "models/thing/model.sdf", "models/thing/meshes/skin.png"])
def test_changed_file_is_noticed_even_at_equal_size(site, textured_world, imports, make_png, changed):
    before = load_world(textured_world)
    path = site.root / changed
    data = path.read_bytes()
    new = make_png((9, 2, 3)) if changed.endswith("png") else data.replace(b"lost", b"gone")
    if changed.endswith("model.sdf"):
        new = data.replace(b"name='l'", b"name='k'")
    assert len(new) == len(data)
    path.write_bytes(new)
    after = load_world(textured_world)
    assert len(imports) == 2
    if changed.endswith("png"):
        assert before.materials[0].texture[0, 0, 0] == 1
        assert after.materials[0].texture[0, 0, 0] == 9


def test_touched_but_equal_file_is_still_good(site, textured_world, imports):
    load_world(textured_world)
    os.utime(site.root / "models/thing/model.sdf", ns=(1, 1))
    load_world(textured_world)
    assert len(imports) == 1


def test_missing_model_that_turns_up_is_noticed(site, link, textured_world):
    assert "lost" in load_world(textured_world).warnings[0]
    site.model("lost", link())
    world = load_world(textured_world)
    assert world.warnings == ()
    assert world.models == ("thing", "lost")


def test_new_script_in_a_searched_folder_is_noticed(site):
    site.file("models/paint/scripts/a.material", "material Other { technique { pass { diffuse 1 1 1 } } }")
    look = "<material><script><uri>model://paint/scripts</uri><name>Mine</name></script></material>"
    box = f"<visual name='v'>{look}<geometry><box><size>1 1 1</size></box></geometry></visual>"
    path = site.world(f"<model name='m'><link name='l'>{box}</link></model>")
    assert load_world(path).warnings == ("Missing and left out: 1 material: Mine.",)
    site.file("models/paint/scripts/b.material", "material Mine { technique { pass { diffuse 0 1 0 } } }")
    assert load_world(path).materials[0].diffuse == (0, 1, 0, 1)


@pytest.mark.parametrize(
    "damage", [lambda data: b"", lambda data: data[: len(data) // 2], lambda data: b"not a zip" * 50]
)
def test_damaged_cache_is_rebuilt(textured_world, imports, damage):
    first = load_world(textured_world)
    (cached,) = (cache_folder() / "worlds").glob("*.npz")
    whole = cached.read_bytes()
    cached.write_bytes(damage(whole))
    assert_same(first, load_world(textured_world))
    assert len(imports) == 2
    assert len(cached.read_bytes()) == len(whole)


def test_one_flipped_bit_in_the_cache_is_noticed(textured_world, imports):
    first = load_world(textured_world)
    (cached,) = (cache_folder() / "worlds").glob("*.npz")
    data = bytearray(cached.read_bytes())
    data[data.index(first.visual.uv.tobytes())] ^= 1
    cached.write_bytes(data)
    assert_same(first, load_world(textured_world))
    assert len(imports) == 2


def test_cache_that_cannot_be_written_is_no_error(textured_world, tmp_path):
    (tmp_path / "file").write_text("in the way")
    assert len(load_world(textured_world, cache_dir=tmp_path / "file").visual) == 4


def test_place_of_the_cache(monkeypatch, tmp_path):
    monkeypatch.delenv("TASKSLAM_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "taskslam"
    monkeypatch.setenv("TASKSLAM_CACHE", str(tmp_path / "own"))
    assert cache_folder() == tmp_path / "own"


def test_world_file_may_be_named_by_a_crooked_path(site, textured_world):
    crooked = site.root / "models" / ".." / "worlds" / "test.world"
    assert load_world(crooked).models == ("thing",)


def test_missing_world_file_is_named(tmp_path):
    with pytest.raises(WorldError, match=r"World file .*nowhere\.world does not exist; expected a Gazebo world"):
        load_world(tmp_path / "nowhere.world")


def test_missing_resource_path_is_named(textured_world, tmp_path):
    with pytest.raises(WorldError, match=r"Resource path .*nothing is not a folder"):
        load_world(textured_world, [tmp_path / "nothing"])


@pytest.fixture
def registered(monkeypatch, make_world):
    def build():
        return make_world([(0, 0, 0, 1, 1, 1)])

    class Entry(EntryPoint):
        def load(self):
            if self.value == "lost:build":
                raise ImportError("no module named lost")
            return build if self.value == "good:build" else lambda: 5

    targets = {"cube": "good:build", "five": "f:5", "lost": "lost:build"}
    entries = {name: Entry(name, target, loading.WORLD_GROUP) for name, target in targets.items()}
    monkeypatch.setattr(loading, "registered", lambda group: entries if group == "taskslam.worlds" else {})


@pytest.mark.usefixtures("registered")
def test_registered_world_by_name():
    assert load_world("cube").models == ("boxes",)


@pytest.mark.usefixtures("registered")
def test_unknown_name_suggests_the_nearest():
    with pytest.raises(
        WorldError, match=r"There is no world 'cub'; .* one of: cube, five, lost\. Did you mean 'cube'\?"
    ):
        load_world("cub")


@pytest.mark.usefixtures("registered")
def test_registered_world_that_is_none_or_cannot_be_imported():
    with pytest.raises(WorldError, match=r"World 'five' \(f:5\) gave int; expected a World"):
        load_world("five")
    with pytest.raises(WorldError, match=r"World 'lost' .* cannot be imported: no module named lost"):
        load_world("lost")
