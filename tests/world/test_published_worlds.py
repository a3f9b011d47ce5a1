"""The four worlds of the benchmark, as their authors published them."""

import time

import numpy as np
import pytest
from scipy.spatial import cKDTree

from taskslam.world.loading import load_world
from taskslam.world.map_server import load_floor_plan


@pytest.fixture(scope="module")
def worlds(data):
    folder = data / "worlds"
    if not folder.is_dir():
        pytest.skip(f"no worlds at {folder}")
    return folder


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="module")
def small_house(worlds, cache):
    return load_world(worlds / "aws_small_house/worlds/small_house.world", cache_dir=cache)


def box_of(world, model):
    """Lowest and highest corner of one model."""
    corners = world.visual.corners()[world.visual.owner == world.models.index(model)].reshape(-1, 3)
    return corners.min(axis=0), corners.max(axis=0)


def test_small_house_is_whole(small_house):
    assert len(small_house.models) == 87
    assert len(small_house.visual) == pytest.approx(145_844, rel=0.02)
    assert small_house.warnings == ("Missing and left out: 1 texture: DeskPortraitB_02.jpg.",)
    assert len(small_house.lights) == 8
    low, high = small_house.bounds()
    assert (high - low).tolist() == pytest.approx([19.0, 11.4, 3.04], abs=0.05)


@pytest.mark.parametrize(
    ("model", "size"),
    [
        ("Bed_01_001", (2.0, 2.0, 1.2)),
        ("Refrigerator_01_001", (0.7, 0.9, 1.8)),
        ("ChairA_01_001", (0.5, 0.5, 0.9)),
        ("SofaC_01_001", (2.3, 2.3, 0.9)),
        ("Ball_01_001", (0.6, 0.6, 0.6)),
    ],
)
def test_furniture_has_believable_size_and_stands_on_the_floor(small_house, model, size):
    low, high = box_of(small_house, model)
    assert (high - low).tolist() == pytest.approx(size, rel=0.25)
    assert low[2] == pytest.approx(0.0, abs=0.1)


def test_nearly_every_surface_of_the_small_house_has_its_texture(small_house):
    textured = np.array([material.texture is not None for material in small_house.materials])
    assert textured[small_house.visual.material].mean() > 0.8


def test_second_start_of_the_small_house_takes_less_than_a_second(small_house, worlds, cache):
    start = time.perf_counter()
    again = load_world(worlds / "aws_small_house/worlds/small_house.world", cache_dir=cache)
    assert time.perf_counter() - start < 1.0
    assert again.visual.vertices.tobytes() == small_house.visual.vertices.tobytes()
    assert again.visual.uv.tobytes() == small_house.visual.uv.tobytes()


def test_small_warehouse_is_whole(worlds, cache):
    world = load_world(worlds / "aws_small_warehouse/worlds/no_roof_small_warehouse.world", cache_dir=cache)
    assert world.warnings == ()
    low, high = world.bounds()
    assert (high - low)[:2].tolist() == pytest.approx([14.0, 20.9], abs=0.1)
    low, high = box_of(world, "aws_robomaker_warehouse_ShelfE_01_001")
    assert 1.5 < (high - low)[2] < 3.0


def test_hospital_loads_with_one_warning_that_names_what_is_missing(worlds, cache):
    world = load_world(worlds / "aws_hospital/worlds/hospital.world", cache_dir=cache)
    (warning,) = world.warnings
    assert warning.startswith("Missing and left out: 43 models (110 instances): AdjTable, AnesthesiaMachine, ")
    assert len(warning.split(": ")[2].split(", ")) == 43
    low, high = box_of(world, "aws_robomaker_hospital_floor_01_walls_1")
    assert (high - low)[:2].tolist() == pytest.approx([25.1, 56.1], abs=0.1)
    low, high = box_of(world, "aws_robomaker_hospital_elevator_01_portal_1")
    assert (high - low)[2] == pytest.approx(2.5, abs=0.1)  # stands, though its mesh is marked Y_UP


def test_tsrb_walls_stand_where_the_map_has_them(worlds, data, cache):
    world = load_world(worlds / "tsrb/fourth_floor_stixel.world", cache_dir=cache)
    plan = load_floor_plan(data / "maps/fourth_floor_gazebo.yaml", free_205=True)
    walls = plan.points_of(np.argwhere(plan.cells == 100))
    corners = world.collision.corners()[world.collision.owner == world.models.index("floorPlan")].astype(float)
    outlines = corners[np.ptp(corners[..., 2], axis=1) > 1.0]  # the sides of the boxes
    weights = np.random.default_rng(0).dirichlet((1, 1, 1), (len(outlines), 60))
    points = np.einsum("tsk,tkd->tsd", weights, outlines).reshape(-1, 3)[:, :2]
    _, nearest = cKDTree(walls).query(points, k=9)
    outside = np.maximum(np.abs(points[:, None] - walls[nearest]) - plan.resolution / 2, 0.0)  # of each square cell
    distance = np.linalg.norm(outside, axis=2).min(axis=1)
    assert len(points) > 50_000
    assert distance.max() < 0.15
