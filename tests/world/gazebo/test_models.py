import os
import time

import pytest

from taskslam.errors import WorldError
from taskslam.world.gazebo import models, resources, surfaces
from taskslam.world.loading import load_world


def include(uri, extra=""):
    return f"<include><uri>{uri}</uri>{extra}</include>"


@pytest.mark.parametrize(
    "uri", ["model://crate", "file://models/crate", "../models/crate", "../models/crate/model.sdf"]
)
def test_every_kind_of_uri_finds_the_model(site, link, uri):
    site.model("crate", link())
    world = site.load(include(uri))
    assert world.models == ("crate",)
    assert len(world.visual) == 12
    assert world.warnings == ()


def test_absolute_file_uri(site, link):
    folder = site.model("crate", link())
    assert len(site.load(include(f"file://{folder}")).visual) == 12


def test_include_gives_name_and_pose(site, link, extent_of):
    site.model("crate", f"<pose>9 9 9 0 0 0</pose>{link()}")
    world = site.load(include("model://crate", "<name>box_7</name><pose>1 2 3 0 0 0</pose>"))
    assert world.models == ("box_7",)
    assert extent_of(world.visual).tolist() == [0.5, 1.5, 2.5, 1.5, 2.5, 3.5]


def test_model_keeps_its_own_pose_where_the_include_has_none(site, link, extent_of):
    site.model("crate", f"<pose>9 0 0 0 0 0</pose>{link()}")
    assert extent_of(site.load(include("model://crate")).visual)[0] == 8.5


def test_include_inside_a_model_stands_in_that_models_frame(site, link, extent_of):
    site.model("crate", link())
    inner = "<static>true</static>" + include("model://crate")
    world = site.load(f"<model name='crate_001'>{inner}<pose frame=''>3 0 0 0 0 0</pose></model>")
    assert world.models == ("crate_001",)
    assert extent_of(world.visual).tolist() == [2.5, -0.5, -0.5, 3.5, 0.5, 0.5]


def test_models_in_models_belong_to_the_outermost(site, link, extent_of):
    inner = f"<model name='b'><pose>0 5 0 0 0 0</pose><model name='c'><pose>0 0 6 0 0 0</pose>{link()}</model></model>"
    world = site.load(f"<model name='a'><pose>4 0 0 0 0 0</pose>{inner}</model>")
    assert world.models == ("a",)
    assert extent_of(world.visual).tolist() == [3.5, 4.5, 5.5, 4.5, 5.5, 6.5]


def test_newest_known_sdf_is_taken(site, link, extent_of):
    config = "".join(f"<sdf version='{v}'>v{v}.sdf</sdf>" for v in ("1.4", "1.12", "1.9", "1.13"))
    folder = site.model("crate", "", config=config)
    for version, side in (("1.4", 4), ("1.9", 9), ("1.12", 10), ("1.13", 12)):
        body = link(size=(side, 1, 1))
        (folder / f"v{version}.sdf").write_text(f"<sdf version='{version}'><model name='m'>{body}</model></sdf>")
    assert extent_of(site.load(include("model://crate")).visual)[3] == 5.0


def test_model_with_only_a_newer_sdf_is_tried(site, link):
    site.model("crate", link(), version="1.14")
    world = site.load(include("model://crate"))
    assert len(world.visual) == 12
    assert world.warnings == ("model.sdf is SDF version '1.14': read as 1.12, the newest that is known.",)


def test_missing_models_are_counted_and_named_in_one_warning(site, link):
    site.model("crate", link())
    body = (
        include("model://crate")
        + include("model://sofa") * 2
        + include("https://fuel.example/1.0/someone/models/Bed/2")
    )
    world = site.load(body)
    assert world.warnings == (
        "Missing and left out: 2 models (3 instances): Bed, sofa.",
        "To get Bed: gz fuel download -u 'https://fuel.example/1.0/someone/models/Bed/2'",
    )
    assert world.models == ("crate",)


def test_downloaded_fuel_model_is_found_by_its_name(site, link):
    site.model("Bed", link())
    assert site.load(include("https://fuel.example/1.0/someone/models/Bed")).models == ("Bed",)


@pytest.mark.parametrize("name", ["Ground Plane", "Sun", "Ground%20Plane/3"])
def test_stock_models_are_known_by_their_fuel_names(site, link, name):
    world = site.load(
        f"<model name='m'>{link()}</model>" + include(f"https://fuel.gazebosim.org/1.0/OpenRobotics/models/{name}")
    )
    assert world.warnings == ()
    assert len(world.lights) + len(world.models) == 2


@pytest.mark.parametrize(("asked", "size"), [("Some Shelf", 3), ("Some%20Shelf/1", 1), ("Some Shelf/tip", 3)])
def test_fuel_cache_has_the_version_that_is_asked_for_or_the_newest(site, link, extent_of, monkeypatch, asked, size):
    for version in (1, 3):
        body = f"<sdf version='1.7'><model name='s'>{link(size=(version, 1, 1))}</model></sdf>"
        site.file(f"cache/fuel.gazebosim.org/owner/models/some shelf/{version}/model.sdf", body)
    monkeypatch.setenv("GZ_FUEL_CACHE_PATH", str(site.root / "cache"))
    world = site.load(include(f"https://fuel.gazebosim.org/1.0/Owner/models/{asked}"))
    assert world.warnings == ()
    assert extent_of(world.visual)[3] == size / 2


def test_world_without_any_model_says_what_is_missing(site):
    with pytest.raises(WorldError, match=r"nothing to load\. Missing and left out: 1 model: sofa"):
        site.load(include("model://sofa"))


@pytest.mark.parametrize(
    "uri", ["model://../../etc/passwd", "../../../../../etc/passwd", "file://../../../../etc/passwd"]
)
def test_path_out_of_its_folder_is_refused(site, uri):
    with pytest.raises(WorldError, match=r"etc/passwd' in .* leads out of its folder"):
        site.load(include(uri))


def test_config_cannot_lead_out_of_the_model(site, link):
    site.model("other", link())
    site.model("crate", link(), config="<sdf version='1.6'>../other/model.sdf</sdf>")
    with pytest.raises(WorldError, match=r"'../other/model.sdf' in .*model.config leads out"):
        site.load(include("model://crate"))


def test_includes_in_a_circle_are_refused(site):
    site.model("hen", include("model://egg"))
    site.model("egg", include("model://hen"))
    with pytest.raises(WorldError, match=r"includes itself: .*hen.*egg.*hen"):
        site.load(include("model://hen"))


def test_world_including_itself_is_refused(site):
    with pytest.raises(WorldError, match=r"includes itself"):
        site.load(include("test.world"))


def test_includes_that_multiply_without_end_are_refused(site, link, monkeypatch):
    monkeypatch.setattr(models, "_MOST_PARTS", 500)
    site.model("m0", link())
    for level in range(1, 25):
        site.model(f"m{level}", include(f"model://m{level - 1}", "<name>a</name>") * 3)
    with pytest.raises(WorldError, match=r"comes to more than 500 models and parts"):
        site.load(include("model://m24"))


def test_models_nested_without_end_are_refused(site):
    deep = "<model name='m'>" * 3000 + "</model>" * 3000
    with pytest.raises(WorldError, match=r"test\.world nests models too deeply"):
        site.load(deep)


def test_resource_paths_of_the_caller_and_the_environment(site, link, tmp_path, monkeypatch):
    site.model("crate", link(size=(1, 1, 1)))
    (tmp_path / "models").rename(tmp_path / "elsewhere")
    path = site.world(include("model://crate"))
    with pytest.raises(WorldError, match="crate"):
        load_world(path, use_cache=False)
    assert len(load_world(path, [tmp_path / "elsewhere"], use_cache=False).visual) == 12
    for variable in ("GAZEBO_MODEL_PATH", "GZ_SIM_RESOURCE_PATH", "GAZEBO_RESOURCE_PATH"):
        monkeypatch.setenv(variable, f"/nonexistent:{tmp_path / 'elsewhere'}")
        assert len(load_world(path, use_cache=False).visual) == 12
        monkeypatch.delenv(variable)


def test_merged_include_becomes_part_of_the_model(site, link, extent_of):
    site.model("leg", link("leg", pose="<pose>0 0 1 0 0 0</pose>"))
    merged = "<include merge='true'><uri>model://leg</uri><pose>5 0 0 0 0 0</pose></include>"
    foot = link("foot", pose="<pose relative_to='leg'>0 0 10 0 0 0</pose>")
    world = site.load(f"<model name='table'>{merged}{foot}</model>", "1.11")
    assert world.models == ("table",)
    assert extent_of(world.visual).tolist() == [4.5, -0.5, 0.5, 5.5, 0.5, 11.5]


def test_sun_and_ground_plane_come_with_the_program(site):
    world = site.load(include("model://sun") + include("model://ground_plane", "<pose>0 0 -1 0 0 0</pose>"))
    assert [light.type for light in world.lights] == ["directional"]
    assert world.bounds().tolist() == [[-50, -50, -1], [50, 50, -1]]
    assert len(world.collision) == 2
    assert world.warnings == ()


STATE = "<state world_name='default'>{}</state>"


def test_state_poses_of_links_stand_above_the_definitions(site, link, extent_of):
    model = f"<model name='m'><pose>1 1 1 0 0 0</pose>{link(pose='<pose>2 2 2 0 0 0</pose>')}</model>"
    state = "<model name='m'><pose>5 0 0 0 0 0</pose><link name='link'><pose>7 8 9 0 0 0</pose></link></model>"
    world = site.load(model + STATE.format(state))
    assert extent_of(world.visual).tolist() == [6.5, 7.5, 8.5, 7.5, 8.5, 9.5]


def test_state_pose_of_a_model_carries_links_without_one(site, link, extent_of):
    model = f"<model name='m'><pose>1 1 1 0 0 0</pose>{link(pose='<pose>2 2 2 0 0 0</pose>')}</model>"
    world = site.load(model + STATE.format("<model name='m'><pose>5 0 0 0 0 0</pose></model>"))
    assert extent_of(world.visual)[:3].tolist() == [6.5, 1.5, 1.5]


def test_state_of_nested_models_and_includes(site, link, extent_of):
    site.model("crate", link())
    model = f"<model name='a'>{include('model://crate')}</model>"
    state = "<model name='a'><model name='crate'><pose>0 0 4 0 0 0</pose></model></model>"
    assert extent_of(site.load(model + STATE.format(state)).visual)[2] == 3.5


def test_state_scale_inserts_and_deletes(site, link, extent_of):
    models = f"<model name='big'>{link()}</model><model name='gone'><pose>50 0 0 0 0 0</pose>{link()}</model>"
    state = (
        "<model name='big'><scale>2 4 6</scale></model><deletions><name>gone</name></deletions>"
        f"<insertions><model name='new'><pose>0 0 10 0 0 0</pose>{link()}</model></insertions>"
    )
    world = site.load(models + STATE.format(state))
    assert world.models == ("big", "new")
    assert extent_of(world.visual).tolist() == [-1, -2, -3, 1, 2, 10.5]


@pytest.mark.parametrize("scale", ["1 2", "a b c", "1 1 nan"])
def test_state_scale_that_is_not_three_numbers_is_refused(site, link, scale):
    state = STATE.format(f"<model name='m'><scale>{scale}</scale></model>")
    with pytest.raises(WorldError, match=r"<scale> in <state> of 'm' in .*expected 3"):
        site.load(f"<model name='m'>{link()}</model>{state}")


def test_file_with_only_a_model_is_a_world(site, link):
    folder = site.model("crate", link())
    assert load_world(folder / "model.sdf", use_cache=False).models == ("crate",)


def test_actors_and_roads_are_left_out_with_a_warning(site, link):
    site.file("models/walker/model.sdf", "<sdf version='1.6'><actor name='walker'/></sdf>")
    odd = include("model://walker") + "<actor name='runner'/><road name='r'/>"
    world = site.load(f"<model name='m'>{link()}</model>" + odd)
    assert world.warnings == ("Not supported and left out: 2 kinds of element (3 uses): <actor>, <road>.",)


@pytest.mark.parametrize("merge", ["", " merge='true'"])
def test_eight_includes_in_each_of_eleven_files_are_refused_in_seconds(site, link, merge):
    site.model("m0", link())
    for level in range(1, 12):
        body = "".join(f"<include{merge}><uri>model://m{level - 1}</uri><name>a{n}</name></include>" for n in range(8))
        site.model(f"m{level}", body)
    begin = time.perf_counter()
    with pytest.raises(WorldError, match="comes to more than 20000 models and parts"):
        site.load(include("model://m11"))
    assert time.perf_counter() - begin < 30


def test_a_mesh_or_a_texture_that_is_a_pipe_is_refused_at_once(site):
    folder = site.file("models/thing/meshes/a.txt", "").parent
    os.mkfifo(folder / "a.stl")
    shape = "<geometry><mesh><uri>model://thing/meshes/a.stl</uri></mesh></geometry>"
    with pytest.raises(WorldError, match=r"a\.stl: cannot read the file of a world: found a pipe or a device"):
        site.load(f"<model name='m'><link name='l'><visual name='v'>{shape}</visual></link></model>")


def test_a_whole_disk_is_not_searched_for_materials(site, monkeypatch):
    monkeypatch.setattr(resources, "MOST_ENTRIES", 20)
    for number in range(30):
        site.file(f"worlds/many/{number}.txt", "")
    look = "<material><script><uri>file://many</uri><name>Wood</name></script></material>"
    shape = "<geometry><box><size>1 1 1</size></box></geometry>"
    with pytest.raises(WorldError, match="holds more than 20 files; expected a folder of material scripts"):
        site.load(f"<model name='m'><link name='l'><visual name='v'>{look}{shape}</visual></link></model>")


def test_a_world_of_more_triangles_than_memory_is_refused(site, link, monkeypatch):
    monkeypatch.setattr(surfaces, "MOST_TRIANGLES", 100)
    with pytest.raises(WorldError, match="more than 100 triangles"):
        site.load("".join(f"<model name='m{n}'>{link()}</model>" for n in range(20)))
