from collections import Counter

import numpy as np
import pytest

from taskslam.world import Material
from taskslam.world.builtin.builder import Builder


def built(draw, extent=(1.0, 1.0), fibrous=False):
    b = Builder(1)
    surface = b.material(Material("paint"), extent, fibrous)
    with b.model("thing"):
        draw(b, surface)
    return b.world("test", (), (1, 1, 1), (0, 0, 0)).visual


def volume(mesh) -> float:
    """Signed volume by the divergence theorem: positive when every face looks outwards."""
    a, b, c = np.moveaxis(mesh.corners().astype(np.float64), 1, 0)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def open_edges(mesh) -> int:
    points = np.round(mesh.corners(), 5)
    edges = Counter()
    for t in points:
        for k in range(3):
            p, q = tuple(t[k]), tuple(t[(k + 1) % 3])
            edges[p, q] += 1
            edges[q, p] -= 1
    return sum(1 for count in edges.values() if count != 0)


SHAPES = {
    "box": (lambda b, s: b.box((0, 0, 0), (1, 2, 3), s), 6.0),
    "soft box": (lambda b, s: b.soft_box((0, 0, 0), (1, 2, 3), s, 0.02), 5.98),
    "cylinder": (lambda b, s: b.cylinder((0, 0), 1.0, 0.0, 2.0, s, sides=64), 2 * np.pi),
    "cone": (lambda b, s: b.cylinder((0, 0), 1.0, 0.0, 3.0, s, top_radius=0.5, sides=64), 1.75 * np.pi),
}


@pytest.mark.parametrize("name", SHAPES)
def test_a_solid_is_closed_and_looks_outwards(name):
    draw, expected = SHAPES[name]
    mesh = built(draw)
    assert open_edges(mesh) == 0
    assert volume(mesh) == pytest.approx(expected, rel=0.005)


@pytest.mark.parametrize("name", SHAPES)
def test_shading_normals_are_unit_and_on_the_outer_side(name):
    mesh = built(SHAPES[name][0])
    a, b, c = np.moveaxis(mesh.corners(), 1, 0)
    outward = np.cross(b - a, c - a)
    assert np.linalg.norm(mesh.normals, axis=2) == pytest.approx(1.0, abs=1e-5)
    assert (np.einsum("ik,ijk->ij", outward, mesh.normals) > 0).all()


def test_texture_coordinates_are_metres_over_the_extent():
    mesh = built(lambda b, s: b.panel((0, 0, 0), (3, 0, 0), (0, 1, 0), s), extent=(2.0, 0.5))
    assert np.ptp(mesh.uv[..., 0]) == pytest.approx(1.5)
    assert np.ptp(mesh.uv[..., 1]) == pytest.approx(2.0)


def test_fibres_run_along_the_longer_edge():
    mesh = built(lambda b, s: b.panel((0, 0, 0), (1, 0, 0), (0, 3, 0), s), fibrous=True)
    corners, uv = mesh.corners()[0], mesh.uv[0]
    along = uv[np.argmax(corners[:, 1])] - uv[np.argmin(corners[:, 1])]
    assert np.ptp(mesh.uv[..., 0]) == pytest.approx(3.0)
    assert abs(along[0]) > 0


def test_a_model_is_turned_and_moved():
    b = Builder(1)
    surface = b.material(Material("paint"), (1.0, 1.0))
    with b.model("thing", 5.0, 1.0, 90.0, 0.5):
        b.box((0, 0, 0), (2, 1, 1), surface)
    low, high = b.world("test", (), (1, 1, 1), (0, 0, 0)).bounds()
    assert low == pytest.approx([4.0, 1.0, 0.5])
    assert high == pytest.approx([5.0, 3.0, 1.5])


def test_what_is_not_solid_is_seen_but_not_touched():
    b = Builder(1)
    surface = b.material(Material("paint"), (1.0, 1.0))
    with b.model("thing"):
        b.box((0, 0, 0), (1, 1, 1), surface)
        b.box((2, 0, 0), (3, 1, 1), surface, solid=False)
    world = b.world("test", (), (1, 1, 1), (0, 0, 0))
    assert (len(world.visual), len(world.collision)) == (24, 12)
