import hashlib
import math
import os
import subprocess
import sys
from functools import cached_property
from importlib import resources
from itertools import pairwise

import numpy as np
import pytest
import yaml
from scipy import ndimage
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from taskslam.simulation.sensors.raytracing import RayCaster
from taskslam.world import World
from taskslam.world.floor_plan import FREE, OCCUPIED
from taskslam.world.loading import load_world
from taskslam.world.slicing import slice_floor_plan

SCAN_HEIGHT = 0.4102
DIGEST = """
import hashlib
from taskslam.world.loading import load_world
world, sha = load_world("NAME"), hashlib.sha256()
for mesh in (world.visual, world.collision):
    for part in (mesh.vertices, mesh.triangles, mesh.material, mesh.uv, mesh.normals, mesh.owner):
        sha.update(part.tobytes())
for material in world.materials:
    sha.update(repr(material.diffuse).encode())
    if material.texture is not None:
        sha.update(material.texture.tobytes())
print(sha.hexdigest())
"""


class Place:
    """A built-in world with the scenario of its name, and what tests ask of both."""

    def __init__(self, world: World):
        self.world = world
        text = (resources.files("taskslam.scenario") / "scenarios" / f"{world.name}.yaml").read_text()
        scenario = yaml.safe_load(text)
        start = [scenario["start"][key] for key in ("x", "y", "theta")]
        self.tour = np.array([start, *scenario["sequence"]["waypoints"]], np.float64)

    @cached_property
    def plan(self):
        """Everything that the robot could touch: above its ground clearance, below its top."""
        return slice_floor_plan(self.world, 0.015, 0.42, seed_point=tuple(self.tour[0, :2]))

    @cached_property
    def clearance(self):
        return ndimage.distance_transform_edt(self.plan.cells != OCCUPIED) * self.plan.resolution

    @property
    def free_area(self):
        return np.count_nonzero(self.plan.cells == FREE) * self.plan.resolution**2

    @property
    def reachable_area(self):
        wide = (self.plan.cells == FREE) & (self.clearance > 0.2)
        return np.count_nonzero(wide) * self.plan.resolution**2

    @cached_property
    def legs(self):
        """Metres from stop to stop and from the last goal to the first, at 0.25 m from everything."""
        wide = (self.plan.cells == FREE) & (self.clearance >= 0.25)
        index, graph = grid_graph(wide, self.plan.resolution)
        stops = index[tuple(self.plan.cells_of(self.tour[:, :2]).T)]
        assert (stops >= 0).all()
        order = [*stops, stops[1]]
        return np.array([dijkstra(graph, directed=False, indices=a)[b] for a, b in pairwise(order)])

    def scan(self, x, y):
        """Triangle and range of 720 rays around a place."""
        angles = np.linspace(-math.pi, math.pi, 720, endpoint=False)
        directions = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1).astype(np.float32)
        return self.hits((x, y, SCAN_HEIGHT), directions)

    def hits(self, origin, directions):
        origins = np.tile(np.array(origin, np.float32), (len(directions), 1))
        triangle, distance, _ = self._caster.hits(origins, directions)
        return triangle, distance

    @cached_property
    def _caster(self):
        return RayCaster(self.world.visual)

    def assert_doorways_are_clear(self, doorways, width):
        """Every passage is free over `width` m, and closed at both ends."""
        for door in doorways:
            middle = (door.start + door.end) / 2
            along = np.arange(door.start - 0.1, door.end + 0.1, 0.005)
            at = np.full_like(along, door.at)
            x, y = (at, along) if door.wall == "x" else (along, at)
            rows, columns = self.plan.cells_of(np.stack([x, y], axis=1)).T
            free = self.plan.cells[rows, columns] == FREE
            assert free[np.abs(along - middle) < width / 2].all(), door
            assert not free[[0, -1]].any(), door


def grid_graph(mask, resolution):
    """Index of each cell of `mask` and the graph to its 16 neighbours (within 2.7 % of any-angle lengths)."""
    index = np.where(mask, np.cumsum(mask).reshape(mask.shape) - 1, -1)
    ends, weights = [], []
    rows, columns = mask.shape
    for dy, dx in [(0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, 1), (2, -1), (1, -2)]:
        a = index[: rows - dy, max(0, -dx) : columns - max(0, dx)]
        b = index[dy:, max(0, dx) : columns + min(0, dx)]
        both = (a >= 0) & (b >= 0)
        ends.append(np.stack([a[both], b[both]]))
        weights.append(np.full(np.count_nonzero(both), math.hypot(dx, dy) * resolution))
    i, j = np.concatenate(ends, axis=1)
    return index, coo_matrix((np.concatenate(weights), (i, j)), shape=(mask.sum(),) * 2).tocsr()


def digest_elsewhere(name, **environment):
    """SHA-256 of a world's arrays as another process builds them."""
    command = [sys.executable, "-W", "ignore", "-c", DIGEST.replace("NAME", name)]
    found = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=True).stdout
    assert len(found) == 2 * hashlib.sha256().digest_size + 1
    return found


NAMES = ("house", "warehouse", "hospital", "office")


@pytest.fixture(scope="session")
def places():
    """Each built-in world by name, built when it is first asked for."""

    class Places(dict):
        def __missing__(self, name):
            self[name] = Place(load_world(name))
            return self[name]

    return Places()


@pytest.fixture(params=NAMES)
def place(request, places):
    return places[request.param]


@pytest.fixture
def digest():
    return digest_elsewhere
