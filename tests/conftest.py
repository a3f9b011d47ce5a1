"""Fixtures for every room: where the real data lies, and a world small enough to reason about."""

from __future__ import annotations

import os
import resource
import signal
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import settings

from taskslam.world import Material, TriangleMesh, World

if TYPE_CHECKING:
    from taskslam.benchmark.stage import Stage

settings.register_profile("shared_machine", deadline=None)  # a busy machine is no defect of the code
settings.load_profile("shared_machine")
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # under nohup it is ignored, and so it would be by what the tests start

_DEFAULT_DATA = Path(__file__).parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of real input; the test is skipped where it is absent."""
    folder = Path(os.environ.get("TASKSLAM_DATA", _DEFAULT_DATA))
    if not folder.is_dir():
        pytest.skip(f"real data not found at {folder}: set TASKSLAM_DATA")
    return folder


@contextmanager
def _full() -> Iterator[None]:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.fixture
def full_disk() -> Callable[[], AbstractContextManager[None]]:
    """`with full_disk():` no file takes more than 20 bytes: the kernel refuses them, as a full disk does."""
    return _full


@pytest.fixture
def register() -> Callable[..., None]:
    """`register(folder, name, version, groups)`: the dist-info of a package with such entry points."""

    def write(folder: Path, name: str, version: str, groups: Mapping[str, Mapping[str, str]]) -> None:
        info = folder / f"{name.replace('-', '_')}-{version}.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
        lines = []
        for group, points in groups.items():
            lines += [f"[{group}]", *(f"{point} = {target}" for point, target in points.items())]
        (info / "entry_points.txt").write_text("\n".join(lines) + "\n")

    return write


@pytest.fixture
def install(tmp_path: Path, register: Callable[..., None]) -> Callable[[Path], Path]:
    """`install(project)`: a folder with a package as an installer leaves it, its modules beside a dist-info."""

    def make(project: Path) -> Path:
        facts = tomllib.loads((project / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        folder = tmp_path / "site-packages"
        register(folder, facts["name"], facts["version"], facts["entry-points"])
        for module in project.glob("*.py"):
            (folder / module.name).write_bytes(module.read_bytes())
        return folder

    return make


def box_mesh(boxes: list[tuple[float, float, float, float, float, float]]) -> TriangleMesh:
    """Axis-aligned boxes (x0, y0, z0, x1, y1, z1) as one mesh."""
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)])
    faces = np.array(
        [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4],
         [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]]
    )  # fmt: skip
    vertices, triangles = [], []
    for index, box in enumerate(boxes):
        low, high = np.array(box[:3]), np.array(box[3:])
        vertices.append(low + corners * (high - low))
        triangles.append(faces + 8 * index)
    count = 12 * len(boxes)
    return TriangleMesh(
        np.concatenate(vertices).astype(np.float32),
        np.concatenate(triangles).astype(np.int32),
        np.zeros(count, np.int32),
        np.zeros((count, 3, 2), np.float32),
        np.zeros((count, 3, 3), np.float32),
        np.zeros(count, np.int32),
    )


@pytest.fixture(scope="session")
def make_world() -> Callable[[list[tuple[float, float, float, float, float, float]]], World]:
    """A world of boxes, the same for eyes and bumper."""

    def make(boxes: list[tuple[float, float, float, float, float, float]]) -> World:
        mesh = box_mesh(boxes)
        return World("boxes", mesh, mesh, (Material("plain"),), ("boxes",))

    return make


@pytest.fixture(scope="session")
def room(make_world: Callable[..., World]) -> World:
    """An 8 m by 6 m room about the origin with a floor, walls 1 m high and one pillar at (2, 1)."""
    return make_world(
        [
            (-4.2, -3.2, -0.2, 4.2, 3.2, 0.0),
            (-4.2, -3.2, 0.0, -4.0, 3.2, 1.0),
            (4.0, -3.2, 0.0, 4.2, 3.2, 1.0),
            (-4.0, -3.2, 0.0, 4.0, -3.0, 1.0),
            (-4.0, 3.0, 0.0, 4.0, 3.2, 1.0),
            (1.9, 0.9, 0.0, 2.1, 1.1, 1.0),
        ]
    )


GOALS = [[2.5, -1.0, 0.0], [2.8, 1.8, 2.0], [-2.0, 1.0, 3.1]]


@pytest.fixture
def make_stage(room: World) -> Callable[..., Stage]:
    """The stage of a tour through the room; keyword arguments override the protocol."""
    from taskslam.benchmark.stage import Stage
    from taskslam.robot import load_robot
    from taskslam.scenario import Scenario
    from taskslam.world.slicing import slice_floor_plan

    def make(goals: list[list[float]] = GOALS, **protocol: Any) -> Stage:
        scenario = Scenario.model_validate(
            {
                "name": "room",
                "world": {"name": "house"},
                "start": {"x": -2.0, "y": -1.0, "theta": 0.0},
                "sequence": {"waypoints": goals},
                "protocol": {"rounds": 2, "pause": 0.5, "still_start": 0.5, **protocol},
            }
        )
        plan = slice_floor_plan(room, 0.02, 0.45, 0.05, seed_point=(-2.0, -1.0))
        return Stage(scenario, room, plan, load_robot("turtlebot2"))

    return make
