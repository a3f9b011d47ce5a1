import io
import math

import numpy as np
import pytest
from PIL import Image

from taskslam.errors import WorldError


@pytest.fixture
def shape(site):
    def load(geometry, visual_pose=""):
        part = f"{visual_pose}<geometry>{geometry}</geometry>"
        return site.load(
            f"<model name='m'><link name='l'><visual name='v'>{part}</visual>"
            f"<collision name='c'>{part}</collision></link></model>"
        )

    return load


@pytest.mark.parametrize(
    ("geometry", "box", "enclosed"),
    [
        ("<box><size>1 2 3</size></box>", [0.5, 1, 1.5], 6.0),
        ("<sphere><radius>2</radius></sphere>", [2, 2, 2], 4 / 3 * math.pi * 8),
        ("<cylinder><radius>1</radius><length>4</length></cylinder>", [1, 1, 2], math.pi * 4),
        ("<capsule><radius>1</radius><length>4</length></capsule>", [1, 1, 3], math.pi * 4 + 4 / 3 * math.pi),
        ("<ellipsoid><radii>1 2 3</radii></ellipsoid>", [1, 2, 3], 4 / 3 * math.pi * 6),
        ("<cone><radius>1</radius><length>3</length></cone>", [1, 1, 1.5], math.pi),
    ],
)
def test_primitives_have_their_size_and_face_outwards(shape, extent_of, volume_of, geometry, box, enclosed):
    world = shape(geometry)
    for mesh in (world.visual, world.collision):
        assert extent_of(mesh).tolist() == pytest.approx([*(-side for side in box), *box], abs=1e-3)
        # facets lie inside the round shapes, by less than 3 %
        assert enclosed * 0.97 < volume_of(mesh) <= enclosed * 1.0001


def test_smooth_normals_point_outwards(shape):
    mesh = shape("<sphere><radius>2</radius></sphere>").visual
    outward = (mesh.corners() * mesh.normals).sum(axis=2)
    assert outward.min() > 1.99


def test_plane_lies_across_its_normal(shape, extent_of):
    world = shape("<plane><normal>1 0 0</normal><size>2 4</size></plane>")
    box = extent_of(world.visual)
    assert box[0] == box[3] == 0
    assert sorted((box[4:] - box[1:3]).tolist()) == [2, 4]
    assert world.visual.normals[..., 0].min() == 1.0
    assert len(world.collision) == 2


def test_polyline_is_extruded(shape, extent_of, volume_of):
    points = "".join(f"<point>{p}</point>" for p in ("0 0", "4 0", "4 1", "1 1", "1 3", "0 3"))
    world = shape(f"<polyline>{points}<height>2</height></polyline>")
    assert extent_of(world.visual).tolist() == [0, 0, 0, 4, 3, 2]
    assert volume_of(world.visual) == pytest.approx((4 + 2) * 2)


@pytest.mark.parametrize("hole", ["1 1,2 1,2 2,1 2", "1 1,1 2,2 2,2 1"])
def test_polyline_inside_another_is_a_hole_whichever_way_it_runs(shape, volume_of, hole):
    def contour(points):
        return (
            "<polyline>" + "".join(f"<point>{p}</point>" for p in points.split(",")) + "<height>1</height></polyline>"
        )

    assert volume_of(shape(contour("0 0,4 0,4 4,0 4") + contour(hole)).visual) == pytest.approx(15.0)


def test_polyline_without_area_is_refused(shape):
    with pytest.raises(WorldError, match="encloses no area"):
        shape("<polyline><point>0 0</point><point>1 0</point><point>2 0</point><height>1</height></polyline>")


def test_radius_must_be_positive(shape):
    with pytest.raises(WorldError, match=r"<sphere> in visual 'v' of link 'l' .* needs a <radius> above 0; it has -1"):
        shape("<sphere><radius>-1</radius></sphere>")


@pytest.mark.parametrize(
    ("geometry", "message"),
    [
        ("<box><size>1 -2 3</size></box>", r"<box> in visual 'v' .* needs a <size> of 0 or more; it has 1 -2 3"),
        ("<ellipsoid><radii>1 0 1</radii></ellipsoid>", r"needs <radii> above 0"),
        ("<plane><normal>0 0 0</normal></plane>", r"normal 0 0 0"),
        ("<mesh/>", r"A <mesh> in visual 'v' .* has no <uri>"),
    ],
)
def test_sizes_that_make_no_sense_are_refused(shape, geometry, message):
    with pytest.raises(WorldError, match=message):
        shape(geometry)


def test_shapes_that_are_not_supported_are_named(site, link):
    odd = "<visual name='v'><geometry><image><uri>x</uri></image></geometry></visual>"
    world = site.load(f"<model name='m'>{link()}<link name='land'>{odd}</link></model>")
    assert world.warnings == ("Not supported and left out: 1 kind of element: <image>.",)


@pytest.mark.parametrize("deep", [False, True])
def test_heightmap_is_terrain(site, shape, extent_of, deep):
    grey = np.zeros((5, 9))
    grey[0, 8] = 200  # upper right: +x, +y
    grey[4, 0] = 100
    buffer = io.BytesIO()
    Image.fromarray((grey * 257).astype(np.uint16) if deep else grey.astype(np.uint8)).save(buffer, "PNG")
    site.file("worlds/land.png", buffer.getvalue())
    place = "<size>8 4 3</size><pos>10 0 1</pos>"
    world = shape(f"<heightmap><uri>land.png</uri>{place}</heightmap>")
    assert extent_of(world.collision).tolist() == [6, -2, 1, 14, 2, 4]
    assert len(world.collision) == 2 * 4 * 8
    heights = {tuple(np.round(corner[:2], 3).tolist()): corner[2] for corner in world.collision.vertices}
    assert (heights[14, 2], heights[6, -2], heights[10, 0]) == (4, 2.5, 1)
    assert world.collision.normals[..., 2].min() > 0


def test_heightmap_that_is_no_image_is_left_out(site, link):
    land = "<geometry><heightmap><uri>land.tif</uri></heightmap></geometry>"
    body = f"<model name='m'>{link()}<link name='l'><collision name='c'>{land}</collision></link></model>"
    assert site.load(body).warnings == ("Missing and left out: 1 heightmap: land.tif.",)
    site.file("worlds/land.tif", b"no image")
    (warning,) = site.load(body).warnings
    assert warning.startswith("Damaged and left out: 1 collision. First: Heightmap ")


@pytest.mark.parametrize(
    ("geometry", "box"),
    [("<sphere/>", [1, 1, 1]), ("<cylinder/>", [1, 1, 0.5]), ("<capsule/>", [0.5, 0.5, 1]), ("<box/>", [0.5] * 3),
     ("<ellipsoid/>", [1, 1, 1])],
)  # fmt: skip
def test_shapes_without_sizes_have_those_of_the_specification(shape, extent_of, geometry, box):
    world = shape(geometry)
    assert extent_of(world.visual).tolist() == pytest.approx([*(-side for side in box), *box], abs=1e-3)


@pytest.mark.parametrize("geometry", ["", "<box><size>0 0 0</size></box>"])
def test_geometry_of_nothing_is_named(site, link, geometry):
    odd = f"<collision name='c'><geometry>{geometry}</geometry></collision>"
    (warning,) = site.load(f"<model name='m'>{link()}<link name='l'>{odd}</link></model>").warnings
    assert warning.startswith("Damaged and left out: 1 collision. First: The <geometry> of collision 'c' of link 'l'")


def test_mesh_scale_and_mirror_keep_the_outside_outside(site, shape, make_dae, extent_of, volume_of):
    site.file("worlds/part.dae", make_dae())
    world = shape("<mesh><uri>part.dae</uri><scale>2 1 -1</scale></mesh>")
    assert extent_of(world.visual).tolist() == [0, 0, -3, 2, 2, 0]
    assert volume_of(world.visual) == pytest.approx(2.0)


NODES = (
    "<node id='a' name='left'><translate>10 0 0</translate>GEOMETRY</node>"
    "<node id='b' name='right'><translate>0 20 0</translate>GEOMETRY</node>"
)


def test_submesh_is_chosen_by_name(site, shape, make_dae, extent_of):
    site.file("worlds/part.dae", make_dae(nodes=NODES))
    world = shape("<mesh><uri>part.dae</uri><submesh><name>right</name></submesh></mesh>")
    assert extent_of(world.visual).tolist() == [0, 20, 0, 1, 22, 3]


def test_centred_submesh_stands_about_the_origin(site, shape, make_dae, extent_of):
    site.file("worlds/part.dae", make_dae(nodes=NODES))
    world = shape("<mesh><uri>part.dae</uri><submesh><name>left</name><center>true</center></submesh></mesh>")
    assert extent_of(world.visual).tolist() == [-0.5, -1, -1.5, 0.5, 1, 1.5]


def test_unknown_submesh_is_told_with_the_known_ones(site, shape, make_dae):
    site.file("worlds/part.dae", make_dae(nodes=NODES))
    with pytest.raises(WorldError, match=r"no submesh 'middle'; it has .*left.*right"):
        shape("<mesh><uri>part.dae</uri><submesh><name>middle</name></submesh></mesh>")


def test_missing_mesh_is_one_warning(site, link):
    lost = "<visual name='v'><geometry><mesh><uri>model://a/b.dae</uri></mesh></geometry></visual>"
    world = site.load(f"<model name='m'>{link()}<link name='l2'>{lost}</link><link name='l3'>{lost}</link></model>")
    assert world.warnings == ("Missing and left out: 1 mesh (2 uses): model://a/b.dae.",)
    assert len(world.visual) == 12


def test_nan_vertices_name_the_mesh(site, shape, make_dae):
    site.file("worlds/part.dae", make_dae(points="0 0 0 1 nan 0 0 2 0 0 0 3"))
    with pytest.raises(WorldError, match=r"Mesh .*part\.dae has NaN or infinite vertices"):
        shape("<mesh><uri>part.dae</uri></mesh>")


def test_triangles_without_area_are_dropped(site, shape):
    site.file("worlds/part.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 2 4\nf 1 1 2\n")
    assert len(shape("<mesh><uri>part.obj</uri></mesh>").visual) == 1
