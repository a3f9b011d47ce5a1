"""Walls raised on a floor plan: a laser meets what the map shows, and a plan sliced from them is the map again."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from taskslam.errors import FloorPlanError
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, LaserScan
from taskslam.robot import load_robot
from taskslam.simulation.simulator import Simulator
from taskslam.world.digest import world_digest
from taskslam.world.extrusion import extruded_world
from taskslam.world.floor_plan import FREE, OCCUPIED, UNKNOWN, FloorPlan
from taskslam.world.map_server import load_floor_plan
from taskslam.world.slicing import slice_floor_plan


@pytest.fixture
def plan() -> FloorPlan:
    """A room of 6 m x 4 m with a pillar, its outside unknown; the grid is turned and moved in the map."""
    cells = np.full((100, 140), UNKNOWN, np.uint8)
    cells[8:92, 8:132] = OCCUPIED
    cells[10:90, 10:130] = FREE
    cells[40:44, 60:70] = OCCUPIED
    return FloorPlan(cells, 0.05, SE2(3.0, -2.0, 0.5))


def test_a_plan_sliced_from_its_walls_is_the_plan_again(plan: FloorPlan) -> None:
    world = extruded_world(FloorPlan(plan.cells, 0.05, SE2(-1.0, 2.0)), 2.0, "room")
    sliced = slice_floor_plan(world, 0.1, 0.4, 0.05, seed_point=(0.0, 3.0))
    rows, columns = np.nonzero(plan.cells == FREE)
    inside = sliced.cells_of(FloorPlan(plan.cells, 0.05, SE2(-1.0, 2.0)).points_of(np.stack([rows, columns], axis=1)))
    # walls are the borders of cells, and a border touches the cells on both sides
    inner = (rows > 10) & (rows < 89) & (columns > 10) & (columns < 129)
    near_the_pillar = (rows > 38) & (rows < 45) & (columns > 58) & (columns < 71)
    at = inside[inner & ~near_the_pillar]
    assert (sliced.cells[at[:, 0], at[:, 1]] == FREE).all()
    pillar = sliced.cells_of(np.array([[-1.0 + 60.5 * 0.05, 2.0 + 40.5 * 0.05]]))[0]
    assert sliced.cells[pillar[0], pillar[1]] != FREE


def test_a_laser_meets_what_the_map_shows(plan: FloorPlan) -> None:
    robot = load_robot("turtlebot2")
    pose = plan.origin @ SE2(3.0, 3.5)
    simulator = Simulator(extruded_world(plan, 2.0, "room"), robot, seed=0)
    simulator.reset(pose)
    scan = next(m for m in simulator.advance(NANOSECONDS) if isinstance(m, LaserScan))
    assert robot.rig.lidar_2d is not None
    laser = pose @ SE2.from_matrix(robot.rig.lidar_2d.mount.matrix())
    checked = 0
    for ray in range(0, len(scan.ranges), 37):
        angle = scan.angle_min + ray * scan.angle_increment
        expected = _marched(plan, laser, angle)
        if expected > scan.range_min + 0.1:
            assert scan.ranges[ray] == pytest.approx(expected, abs=0.1), f"at {angle:.2f} rad"
            checked += 1
    assert checked > 5


def _marched(plan: FloorPlan, laser: SE2, angle: float) -> float:
    for step in range(2000):
        at = laser @ SE2(step * 0.005 * math.cos(angle), step * 0.005 * math.sin(angle))
        if plan.at(at.x, at.y) == OCCUPIED:
            return step * 0.005
    return math.inf


def test_the_same_plan_gives_the_same_bytes(plan: FloorPlan) -> None:
    assert world_digest(extruded_world(plan, 2.0, "room")) == world_digest(extruded_world(plan, 2.0, "room"))


def test_long_walls_are_cut_and_look_different(plan: FloorPlan) -> None:
    world = extruded_world(plan, 2.0, "room")
    lengths = np.linalg.norm(np.ptp(world.visual.corners()[..., :2], axis=1), axis=1)
    walls = world.visual.owner == 0
    assert lengths[walls].max() <= 4.0 + 1e-5
    assert len(set(world.visual.material[walls].tolist())) >= 3
    assert world.lights


def test_a_plan_without_walls_is_refused() -> None:
    with pytest.raises(FloorPlanError, match="'yard' has no occupied cell"):
        extruded_world(FloorPlan(np.zeros((10, 10), np.uint8), 0.05, SE2()), 2.0, "yard")


def test_a_photo_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("taskslam.world.extrusion._MOST_PANELS", 1000)
    noise = np.where(np.random.default_rng(0).random((100, 100)) < 0.5, OCCUPIED, FREE).astype(np.uint8)
    with pytest.raises(FloorPlanError, match="pieces of wall; expected at most 1000"):
        extruded_world(FloorPlan(noise, 0.05, SE2()), 2.0, "photo")


def test_the_published_house_can_be_raised(data: Path) -> None:
    world = extruded_world(load_floor_plan(data / "maps" / "aws_small_house.yaml"), 2.2, "aws")
    assert 1000 < len(world.collision) < 3000
