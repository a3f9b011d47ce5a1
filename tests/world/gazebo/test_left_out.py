"""Nothing vanishes unsaid: what a world declares is loaded, or named in a warning."""

import json
import struct

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from taskslam.errors import WorldError
from taskslam.world.loading import load_world

BOX = "<geometry><box><size>1 1 1</size></box></geometry>"


def visual(geometry, name="v"):
    return f"<visual name='{name}'>{geometry}</visual>"


def model(content, name="m", pose="0 0 0 0 0 0"):
    return f"<model name='{name}'><pose>{pose}</pose><link name='l'>{content}</link></model>"


def mesh(name):
    return f"<geometry><mesh><uri>{name}</uri></mesh></geometry>"


@pytest.mark.parametrize("place", ["<mesh>", "</source>", '<vertices id="v">', '<triangles count="4" material="m">'])
def test_comment_in_a_collada_mesh_takes_nothing_away(site, make_dae, extent_of, place):
    site.file("worlds/a.dae", make_dae().replace(place, f"{place}<!-- exporter -- note -->", 1))
    world = site.load(model(visual(mesh("a.dae"))))
    assert extent_of(world.visual).tolist() == [0, 0, 0, 1, 2, 3]
    assert world.warnings == ()


def test_collada_geometry_that_cannot_be_read_is_named(site, make_dae):
    whole = make_dae(
        nodes="<node id='n'>GEOMETRY<instance_geometry url='#wall'/><instance_geometry url='#gone'/></node>"
    )
    triangles = "<triangles count='1'><input semantic='VERTEX' source='#no' offset='0'/><p>0 1 2</p></triangles>"
    wall = f"<geometry id='wall'><mesh>{triangles}</mesh></geometry>"
    site.file("worlds/a.dae", whole.replace("<library_geometries>", f"<library_geometries>{wall}"))
    world = site.load(model(visual(mesh("a.dae"))))
    assert len(world.visual) == 4
    (warning,) = world.warnings
    assert warning.startswith("Damaged and left out: 2 parts of meshes: geometry 'gone' of a.dae (Dae")
    assert "geometry 'wall' of a.dae" in warning


def test_collada_polygon_with_a_hole_is_named(site, make_dae):
    hole = "<input semantic='VERTEX' source='#v' offset='0'/><ph><p>0 1 2</p><h>0 1 3</h></ph>"
    holed = f"<polygons count='1'>{hole}</polygons>"
    site.file("worlds/a.dae", make_dae().replace("</mesh>", f"{holed}</mesh>"))
    world = site.load(model(visual(mesh("a.dae"))))
    assert len(world.visual) == 4
    assert world.warnings == ("Damaged and left out: 1 part of a mesh: geometry 'g' of a.dae.",)


def test_collada_materials_that_are_broken_cost_no_geometry(site, make_dae):
    site.file("worlds/a.dae", make_dae().replace('<instance_effect url="#e"/>', '<instance_effect url="#no"/>'))
    assert len(site.load(model(visual(mesh("a.dae")))).visual) == 4


def test_collada_nodes_that_multiply_without_end_are_refused(site, make_dae):
    twice = "".join(
        f"<node id='n{k}'><instance_node url='#n{k + 1}'/><instance_node url='#n{k + 1}'/></node>" for k in range(40)
    )
    site.file("worlds/a.dae", make_dae(nodes=f"{twice}<node id='n40'>GEOMETRY</node>"))
    with pytest.raises(WorldError, match=r"a\.dae .* comes to more than 100000 nodes"):
        site.load(model(visual(mesh("a.dae"))))


def test_collada_node_that_is_instantiated_elsewhere_is_followed(site, make_dae, extent_of):
    nodes = (
        "<node id='a'><translate>10 0 0</translate><instance_node url='#shared'/></node>"
        "<node id='b'><translate>20 0 0</translate><instance_node url='#shared'/></node>"
    )
    library = "<library_nodes><node id='shared'>GEOMETRY</node></library_nodes>"
    whole = make_dae(nodes=nodes + library)
    start, end = whole.index("<library_nodes>"), whole.index("</library_nodes>") + len("</library_nodes>")
    shared, whole = whole[start:end], whole[:start] + whole[end:]
    site.file("worlds/a.dae", whole.replace("<library_visual_scenes>", f"{shared}<library_visual_scenes>"))
    world = site.load(model(visual(mesh("a.dae"))))
    assert extent_of(world.visual).tolist() == [10, 0, 0, 21, 2, 3]
    assert (len(world.visual), world.warnings) == (8, ())


def test_collada_image_without_a_path_costs_the_texture(site, make_dae):
    site.file("worlds/a.dae", make_dae(image=" ").replace("<init_from> </init_from>", ""))
    world = site.load(model(visual(mesh("a.dae"))))
    assert len(world.visual) == 4
    assert world.warnings == ("Damaged and left out: 1 material: mat of a.dae.",)


DOORWAY = [(-2, 0), (-0.6, 0), (-0.6, 2), (0.6, 2), (0.6, 0), (2, 0), (2, 2.5), (-2, 2.5)]
AREA = 4 * 2.5 - 1.2 * 2


def covers(triangles, point):
    """Whether a point lies in one of the (T, 3, 2) triangles."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    turns = [(q[:, 0] - p[:, 0]) * (point[1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (point[0] - p[:, 0])
             for p, q in ((a, b), (b, c), (c, a))]  # fmt: skip
    return bool((np.all(np.array(turns) > 0, axis=0) | np.all(np.array(turns) < 0, axis=0)).any())


def doorway_is_open(mesh_in_world, turned):
    wall = mesh_in_world.corners().astype(float) @ turned
    areas = np.linalg.norm(np.cross(wall[:, 1] - wall[:, 0], wall[:, 2] - wall[:, 0]), axis=1) / 2
    assert areas.sum() == pytest.approx(AREA, rel=1e-5)
    assert not covers(wall[..., [0, 2]], (0.01, 1.03))
    assert covers(wall[..., [0, 2]], (-1.31, 1.03))
    assert covers(wall[..., [0, 2]], (0.02, 2.27))


def rotation(rng):
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.diag(r))


variations = settings(
    max_examples=40, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@given(first=st.integers(0, 7), backwards=st.booleans(), form=st.sampled_from(["", "-", "/", "//", "-/"]),
       seed=st.integers(0, 999), continued=st.booleans())  # fmt: skip
@variations
def test_doorway_in_an_obj_polygon_is_open(site, first, backwards, form, seed, continued):
    ring = np.roll(np.arange(8), first)[:: -1 if backwards else 1]
    turned = rotation(np.random.default_rng(seed))
    points = np.array([(x, 0.3, z) for x, z in DOORWAY]) @ turned.T
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in points]
    lines += ["vt 0 0", "vn 0 1 0", "o wall"]
    tail = {"/": "/1", "//": "//1"}.get(form.strip("-") or "-", "")
    corners = [f"{k - 8 if form.startswith('-') else k + 1}{tail}" for k in ring.tolist()]
    lines.append("  f " + (" \\\n" if continued else " ").join(corners))
    site.file("worlds/wall.obj", "\n".join(lines) + "\n")
    world = site.load(model(visual(mesh("wall.obj"))))
    assert world.warnings == ()
    doorway_is_open(world.visual, turned)


@pytest.mark.parametrize("kind", ["polylist", "polygons"])
@given(first=st.integers(0, 7), backwards=st.booleans(), seed=st.integers(0, 999))
@variations
def test_doorway_in_a_collada_polygon_is_open(site, make_dae, kind, first, backwards, seed):
    ring = np.roll(np.arange(8), first)[:: -1 if backwards else 1]
    turned = rotation(np.random.default_rng(seed))
    points = np.array([(x, 0.3, z) for x, z in DOORWAY]) @ turned.T
    whole = make_dae(points=" ".join(f"{value:.9f}" for value in points.ravel()))
    whole = whole.replace('count="12"', 'count="24"').replace('count="4" stride="3"', 'count="8" stride="3"')
    start, end = whole.index("<triangles"), whole.index("</triangles>") + len("</triangles>")
    index = " ".join(f"{k} 0" for k in ring.tolist())
    inputs = whole[whole.index('<input semantic="VERTEX"') : whole.index("<p>")]
    count = "<vcount>8</vcount>" if kind == "polylist" else ""
    polygon = f'<{kind} count="1" material="m">{inputs}{count}<p>{index}</p></{kind}>'
    site.file("worlds/wall.dae", whole[:start] + polygon + whole[end:])
    world = site.load(model(visual(mesh("wall.dae"))))
    assert world.warnings == ()
    doorway_is_open(world.visual, turned)


def glb(change):
    """A box as .glb whose header was changed."""
    data = trimesh.Scene(trimesh.creation.box()).export(file_type="glb")
    (length,) = struct.unpack_from("<I", data, 12)
    header = json.loads(data[20 : 20 + length])
    change(header)
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest


@pytest.mark.parametrize(
    "extension", ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_mesh_quantization"]
)
def test_gltf_that_needs_what_is_not_read_is_named(site, extension):
    site.file("worlds/a.glb", glb(lambda header: header.update(extensionsRequired=[extension, "KHR_materials_unlit"])))
    world = site.load(model(visual(mesh("a.glb"))) + model(visual(BOX), "n"))
    assert len(world.visual) == 12
    (warning,) = world.warnings
    assert warning.startswith("Damaged and left out: 1 visual. First: ")
    assert f"a.glb is not a GLB mesh that can be read: it needs {extension}, which is not read" in warning
    with pytest.raises(WorldError, match=extension):
        site.load(model(visual(mesh("a.glb"))))


def test_gltf_primitive_of_an_unread_mode_is_counted(site):
    def fan(header):
        (primitive,) = header["meshes"][0]["primitives"]
        header["meshes"][0]["primitives"].append({**primitive, "mode": 6})

    site.file("worlds/a.glb", glb(fan))
    world = site.load(model(visual(mesh("a.glb"))))
    assert len(world.visual) == 12
    assert world.warnings == ("Damaged and left out: 1 part of a mesh: 34 triangles of a.glb.",)


def test_world_that_is_merged_into_another_stands_in_it(site, link, extent_of):
    inner = (
        "<frame name='corner'><pose>0 0 1 0 0 0</pose></frame><light name='lamp' type='point'/>"
        f"<model name='far'><pose relative_to='corner'>5 0 0 0 0 0</pose>{link()}</model>"
    )
    site.file("models/room/model.sdf", f"<sdf version='1.10'><world name='room'>{inner}</world></sdf>")
    merge = "<include merge='true'><uri>model://room</uri><pose>0 2 0 0 0 0</pose></include>"
    outer = model(visual(BOX), "near") + merge
    world = site.load(outer, "1.10")
    assert world.models == ("near", "far")
    assert extent_of(world.visual).tolist() == [-0.5, -0.5, -0.5, 5.5, 2.5, 1.5]
    assert [light.pose[:3, 3].tolist() for light in world.lights] == [[0, 2, 0]]
    assert world.warnings == ()


def test_model_that_is_merged_into_a_world_is_included(site, link):
    site.model("crate", link())
    assert site.load("<include merge='true'><uri>model://crate</uri></include>").models == ("crate",)


def test_merge_places_the_frame_that_it_names(site, link, extent_of):
    site.model("arm", f"{link('l')}<frame name='tip'><pose>3 0 0 0 0 0</pose></frame>", version="1.9")
    place = "<placement_frame>tip</placement_frame><pose>10 0 0 0 0 0</pose>"
    merge = f"<include merge='true'><uri>model://arm</uri>{place}</include>"
    world = site.load(f"<model name='robot'>{merge}</model>", "1.9")
    assert extent_of(world.visual).tolist() == [6.5, -0.5, -0.5, 7.5, 0.5, 0.5]


@pytest.mark.parametrize("namespace", ["http://www.ros.org/wiki/xacro", "http://ros.org/wiki/xacro"])
def test_macros_are_to_be_expanded_first_where_nothing_expands_them(site, namespace, monkeypatch):
    monkeypatch.setattr("taskslam.world.gazebo.resources.xacro_program", lambda: None)
    body = f"<xacro:if value='true' xmlns:xacro='{namespace}'>{model(visual(BOX))}</xacro:if>{model(visual(BOX), 'n')}"
    with pytest.raises(WorldError, match=r"test\.world holds xacro macros: expand them first, xacro test\.world"):
        site.load(body)


def with_macros(site, name, body):
    return site.file(f"worlds/{name}", f"<sdf version='1.6' xmlns:xacro='http://www.ros.org/wiki/xacro'>{body}</sdf>")


def test_macros_are_expanded_where_xacro_is_installed_and_the_cache_knows_their_files(site, extent_of):
    pytest.importorskip("xacro", reason="comes with taskslam[xacro]")
    boxed = model(f"<pose>${{x}} 0 0 0 0 0</pose>{visual(BOX)}", "m${x}")
    macro = f"<xacro:macro name='boxed' params='x'>{boxed}</xacro:macro>"
    file = with_macros(site, "parts.xacro", macro)
    uses = "<xacro:boxed x='0'/><xacro:boxed x='${2 * 3}'/>"
    never = f"<xacro:if value='false'>{model(visual(BOX), 'n')}</xacro:if>"
    include = "<xacro:include filename='parts.xacro'/>"
    path = with_macros(site, "test.world", f"{include}<world name='w'>{uses}{never}</world>")
    world = load_world(path)
    assert world.models == ("m0", "m6")
    assert extent_of(world.visual)[[0, 3]].tolist() == [-0.5, 6.5]
    assert world.warnings == ("test.world holds xacro macros, which xacro expanded.",)
    file.write_text(file.read_text().replace("m${x}", "box${x}"))
    assert load_world(path).models == ("box0", "box6")


def test_what_xacro_cannot_expand_is_its_own_sentence(site):
    pytest.importorskip("xacro", reason="comes with taskslam[xacro]")
    body = f"<world name='w'><xacro:if value='${{nothing_such}}'>{model(visual(BOX))}</xacro:if></world>"
    with pytest.raises(WorldError, match=r"test\.world holds xacro macros that xacro cannot expand: .*nothing_such"):
        load_world(with_macros(site, "test.world", body))


@pytest.mark.parametrize(
    ("strange", "name"),
    [
        (f"<group>{model(visual(BOX), 'inner')}</group>", "<group>"),
        (f"<fancy:group xmlns:fancy='x'>{model(visual(BOX), 'inner')}</fancy:group>", "<group>"),
        (f"<model name='o'><shell>{visual(BOX)}</shell><link name='l'>{visual(BOX)}</link></model>", "<shell>"),
        (model(visual(BOX) + f"<skin>{BOX}</skin>", "o"), "<skin> of a link"),
    ],
)
def test_unknown_element_with_something_solid_in_it_is_named(site, strange, name):
    world = site.load(strange + model(visual(BOX)))
    assert world.warnings == (f"Not supported and left out: 1 kind of element: {name}.",)


def test_second_world_of_a_file_is_named(site):
    path = site.world(model(visual(BOX)))
    path.write_text(path.read_text().replace("</sdf>", f"<world name='b'>{model(visual(BOX))}</world></sdf>"))
    assert load_world(path, use_cache=False).warnings == (
        "Not supported and left out: 1 kind of element: <world> after the first.",
    )
