"""What every built-in world keeps to, with the tour of the scenario that has its name."""

import numpy as np
import pytest

from taskslam.world.floor_plan import FREE
from taskslam.world.slicing import slice_floor_plan

# goals and metres of the published tours (Table I of the paper)
PUBLISHED = {"house": (12, 45), "warehouse": (16, 70), "hospital": (19, 220), "office": (17, 260)}


def test_meshes_are_sound(place):
    world = place.world
    for mesh in (world.visual, world.collision):
        assert np.isfinite(mesh.vertices).all()
        assert np.isfinite(mesh.uv).all()
        assert mesh.triangles.max() < len(mesh.vertices)
        assert mesh.material.min() >= 0
        assert mesh.material.max() < len(world.materials)
        assert mesh.owner.max() < len(world.models)
        assert np.linalg.norm(mesh.normals, axis=2) == pytest.approx(1.0, abs=1e-5)
        a, b, c = np.moveaxis(mesh.corners(), 1, 0)
        assert (np.einsum("ik,ijk->ij", np.cross(b - a, c - a), mesh.normals) > 0).all()


def test_size_is_that_of_something_to_render_in_real_time(place):
    assert len(place.world.visual) < 150_000
    sizes = [m.texture.shape for m in place.world.materials if m.texture is not None]
    assert len(sizes) >= 50
    assert max(max(shape[:2]) for shape in sizes) <= 1024
    assert sum(np.prod(shape) for shape in sizes) < 150e6


def test_every_material_covers_something(place):
    assert set(place.world.visual.material.tolist()) == set(range(len(place.world.materials)))


def test_goals_have_room_around_them(place):
    goals, _ = PUBLISHED[place.world.name]
    assert place.tour.shape == (goals + 1, 3)
    rows, columns = place.plan.cells_of(place.tour[:, :2]).T
    assert (place.plan.cells[rows, columns] == FREE).all()
    assert place.clearance[rows, columns].min() >= 0.5


def test_the_tour_is_connected_and_as_long_as_the_published_one(place):
    _, metres = PUBLISHED[place.world.name]
    assert np.isfinite(place.legs).all()
    assert place.legs.min() > 1.0
    assert place.legs[:-1].sum() == pytest.approx(metres, rel=0.1)
    assert place.legs[-1] < 15, "rounds after the first start from the last goal"


def test_the_laser_meets_walls_and_furniture_from_every_goal(place):
    world = place.world
    shell = np.array([name.endswith(("shell", "facade")) or name.startswith("doorway") for name in world.models])
    shares = []
    for x, y, _ in place.tour:
        triangle, _ = place.scan(x, y)
        assert (triangle >= 0).all(), "no ray leaves the building"
        shares.append(np.mean(~shell[world.visual.owner[triangle]]))
    assert min(shares) > 0.01, "a plain corridor"
    assert np.mean(shares) > 0.12


def test_scans_tell_the_goals_apart(place):
    """Sorted ranges do not depend on the heading: no two goals may look alike to the laser."""
    profiles = [np.sort(place.scan(x, y)[1]) for x, y, _ in place.tour]
    for i, a in enumerate(profiles):
        for b in profiles[:i]:
            assert np.array_equal(place.tour[i], place.tour[0]) or np.abs(a - b).mean() > 0.10


def test_the_camera_sees_a_closed_building_with_a_ceiling(place):
    steps = np.linspace(-0.95, 0.95, 24)
    x, y, z = np.meshgrid(steps, steps, steps)
    directions = np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(np.float32)
    for px, py, _ in place.tour:
        triangle, _ = place.hits((px, py, 0.3), directions)
        assert (triangle >= 0).all()
        a, b, c = np.moveaxis(place.world.visual.corners()[triangle], 1, 0)
        away = np.einsum("ij,ij->i", np.cross(b - a, c - a), directions) > 0
        assert away.mean() < 0.01, "surfaces are seen from their front"


def test_floors_are_flat(place):
    """Markings, rugs and thresholds are driven over."""
    low = slice_floor_plan(place.world, 0.009, 0.42, seed_point=tuple(place.tour[0, :2]))
    rows, columns = low.cells_of(place.tour[:, :2]).T
    assert (low.cells[rows, columns] == FREE).all()


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_world_does_not_depend_on_hash_seed_or_vector_unit(name, digest):
    plain = "AVX2 FMA3 AVX512F AVX512_SKX AVX512CD X86_V3 X86_V4"
    assert digest(name, PYTHONHASHSEED="1") == digest(name, PYTHONHASHSEED="2", NPY_DISABLE_CPU_FEATURES=plain)
