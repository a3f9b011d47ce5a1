import struct

import numpy as np
import pytest
import trimesh

from taskslam.errors import WorldError


@pytest.fixture
def mesh(site):
    def load(name, content):
        site.file(f"models/thing/meshes/{name}", content)
        geometry = f"<geometry><mesh><uri>model://thing/meshes/{name}</uri></mesh></geometry>"
        return site.load(f"<model name='m'><link name='l'><visual name='v'>{geometry}</visual></link></model>")

    return load


@pytest.mark.parametrize(("unit", "factor"), [("1", 1.0), ("0.01", 0.01), ("0.0254", 0.0254)])
def test_collada_unit_is_applied(mesh, make_dae, extent_of, unit, factor):
    world = mesh("a.dae", make_dae(unit=unit))
    assert extent_of(world.visual)[3:].tolist() == pytest.approx([factor, 2 * factor, 3 * factor], abs=1e-4)


@pytest.mark.parametrize("up", ["X_UP", "Y_UP", "Z_UP"])
def test_collada_up_axis_is_ignored_as_gazebo_ignores_it(mesh, make_dae, extent_of, up):
    assert extent_of(mesh("a.dae", make_dae(up=up)).visual).tolist() == [0, 0, 0, 1, 2, 3]


def test_collada_node_transforms_compose(mesh, make_dae, extent_of):
    inner = "<node id='b'><scale>2 2 2</scale>GEOMETRY</node>"
    nodes = f"<node id='a'><translate>10 0 0</translate><rotate>0 0 1 90</rotate>{inner}</node>"
    assert extent_of(mesh("a.DAE", make_dae(nodes=nodes)).visual).tolist() == [6, 0, 0, 10, 2, 6]


def test_collada_material_colour(mesh, make_dae):
    world = mesh("a.dae", make_dae())
    assert [m.diffuse for m in world.materials] == [(1, 0, 0, 1)]


def test_collada_faces_outwards(mesh, make_dae, volume_of):
    assert volume_of(mesh("a.dae", make_dae()).visual) == pytest.approx(1.0)


def test_broken_collada_names_the_file(mesh):
    with pytest.raises(WorldError, match=r"a\.dae is not a COLLADA mesh that can be read"):
        mesh("a.dae", "<nothing/>")


OBJ = """mtllib a.mtl
o lid
v 0 0 0
v 1 0 0
v 0 2 0
v 0 0 3
vt 0 0
vt 1 0
vt 0 1
usemtl paint
f 1/1 2/2 3/3
f 1/1 2/2 4/3
"""


def test_obj_with_its_material_and_texture(site, mesh, make_png, extent_of):
    site.file("models/thing/meshes/a.mtl", "newmtl paint\nKd 0.5 0.5 0.5\nmap_Kd skin.png\n")
    site.file("models/thing/meshes/skin.png", make_png((10, 20, 30)))
    world = mesh("a.obj", OBJ)
    assert extent_of(world.visual).tolist() == [0, 0, 0, 1, 2, 3]
    (material,) = world.materials
    assert material.texture[0, 0].tolist() == [10, 20, 30]
    assert world.visual.uv[0].tolist() == [[0, 0], [1, 0], [0, 1]]
    assert world.warnings == ()


def test_objects_of_an_obj_are_submeshes(site, extent_of):
    faces = "".join(
        f"o part{k}\nv {k} 0 0\nv {k} 1 0\nv {k} 0 1\nf {3 * k + 1} {3 * k + 2} {3 * k + 3}\n" for k in range(3)
    )
    site.file("worlds/a.obj", faces)
    geometry = "<geometry><mesh><uri>a.obj</uri><submesh><name>part1</name></submesh></mesh></geometry>"
    world = site.load(f"<model name='m'><link name='l'><visual name='v'>{geometry}</visual></link></model>")
    assert extent_of(world.visual).tolist() == [1, 0, 0, 1, 1, 1]


def test_obj_with_a_missing_texture_warns(site, mesh):
    site.file("models/thing/meshes/a.mtl", "newmtl paint\nmap_Kd skin.png\n")
    assert mesh("a.obj", OBJ).warnings == ("Missing and left out: 1 texture: skin.png.",)


def test_binary_stl(mesh, extent_of):
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0]], dtype="<f4")
    world = mesh("a.stl", b"\0" * 80 + struct.pack("<I", 1) + b"\0" * 12 + corners.tobytes() + b"\0\0")
    assert extent_of(world.visual).tolist() == [0, 0, 0, 1, 2, 0]


def test_gltf_is_taken_as_it_stands_as_gazebo_takes_it(mesh, extent_of):
    box = trimesh.creation.box(extents=(1, 4, 2))
    box.apply_translation((0, 2, 0))
    world = mesh("a.glb", trimesh.Scene(box).export(file_type="glb"))
    assert extent_of(world.visual).tolist() == [-0.5, 0, -1, 0.5, 4, 1]


@pytest.mark.parametrize("name", ["a.obj", "a.stl", "a.glb", "a.gltf"])
def test_damaged_mesh_is_one_sentence(mesh, name):
    with pytest.raises(WorldError, match=name) as caught:
        mesh(name, b"f 1 2 3\n\xff\xfe garbage")
    assert "\n" not in str(caught.value)


def test_nan_in_stl_names_the_mesh(mesh):
    corners = np.array([[0, 0, 0], [1, np.nan, 0], [0, 2, 0]], dtype="<f4")
    with pytest.raises(WorldError, match=r"Mesh .*a\.stl has NaN"):
        mesh("a.stl", b"\0" * 80 + struct.pack("<I", 1) + b"\0" * 12 + corners.tobytes() + b"\0\0")


def test_unknown_format_is_told_with_the_known_ones(mesh):
    with pytest.raises(WorldError, match=r"a\.fbx has an unknown format; expected \.dae, \.obj"):
        mesh("a.fbx", b"x")
