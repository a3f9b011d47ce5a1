"""Whole measurements on rendered pictures of known poses: from image folders and logs to metrics."""

import json
import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

from taskslam.errors import InputError
from taskslam.evaluation import evaluate_runs
from taskslam.geometry import SE2, rotation_from_rpy
from taskslam.realworld.association import Verdict
from taskslam.realworld.camera_files import save_camera
from taskslam.realworld.camera_model import Camera
from taskslam.realworld.measure import measure_inside_out, measure_outside_in
from taskslam.realworld.setup_file import InsideOutSetup, OutsideInSetup, load_setup
from taskslam.realworld.tag_family import code_cells
from taskslam.realworld.tag_plane import TagPlane
from taskslam.record import load_run

SIZE, TAG = 0.19, 7
START = 1_700_000_000.0
PAUSE = 5.0
GOALS = ((0.45, 0.1, 30.0), (-0.4, -0.15, -90.0))
CAMERA = Camera("east", 640, 480, np.array([[520.0, 0, 322], [0, 522.0, 238], [0, 0, 1]]), np.array([-0.1, 0.03, 0, 0]))
PLANE = TagPlane(rotation_from_rpy(math.radians(20), 0.05, 0) @ np.array([0, 0, -1.0]), -2.1)
MIDDLE = SE2(*PLANE.meet(np.zeros((1, 2)))[0])


@dataclass
class Tour:
    """Where the robot truly stood (in the floor frame), and what is on disk."""

    folder: Path
    truth: dict[tuple[int, int], SE2] = field(default_factory=dict)
    setup: Path = Path()

    def change(self, **keys: object) -> Path:
        """A copy of the setup file with other keys; those of the only camera by `camera__key`."""
        content = yaml.safe_load(self.setup.read_text())
        for key, value in keys.items():
            camera, _, name = key.rpartition("__")
            (content["cameras"][0] if camera else content)[name] = value
        path = self.folder / f"changed{len(list(self.folder.glob('changed*')))}.yaml"
        path.write_text(yaml.safe_dump(content))
        return path


def board(T_plane_tag: SE2) -> np.ndarray:
    """T_camera_board of a tag in the floor plane: the board's origin is its top left corner, x right, y down."""
    T_tag_board = np.eye(4)
    T_tag_board[:3, :3] = np.array([[0, -1, 0], [-1, 0, 0], [0, 0, -1.0]])
    T_tag_board[:3, 3] = SIZE / 2, SIZE / 2, 0
    return PLANE.T_camera_plane @ T_plane_tag.matrix() @ T_tag_board


@pytest.fixture(scope="module")
def tour(tmp_path_factory, photograph) -> Tour:
    """Two waypoints under one camera, three rounds; a clock that is 0.4 s ahead; the robot drives in between."""
    made = Tour(tmp_path_factory.mktemp("tour"))
    rng = np.random.default_rng(3)
    images = made.folder / "east"
    images.mkdir()
    cells = code_cells("tag36h11", TAG)

    def shoot(pose: SE2, stamps: list[float]) -> None:
        picture = Image.fromarray(photograph(CAMERA, cells, SIZE / 8, board(pose), seed=int(stamps[0])))
        for stamp in stamps:
            picture.save(images / f"{stamp + 0.4:.3f}.jpg", quality=92)

    rows = ["time,round,waypoint"]
    now = START
    for number in range(3):
        for goal, (x, y, heading) in enumerate(GOALS):
            off = rng.normal(0, (0.04, 0.04, 5))
            at = MIDDLE @ SE2(x + off[0], y + off[1], math.radians(heading + off[2]))
            made.truth[number, goal] = at
            for step in range(3):
                way = MIDDLE @ SE2(*rng.uniform([-0.6, -0.35, -3], [0.6, 0.35, 3]))
                shoot(way, [now + step])
            now += 4.0 + rng.uniform(0, 2)
            shoot(at, [now + second for second in (0.2, 1.2, 2.2, 3.2, 4.2)])
            now += PAUSE
            rows.append(f"{now:.3f},{number + 1},{goal + 1}")
        now += 7.0 + 5 * number
    (made.folder / "arrivals.csv").write_text("\n".join(rows) + "\n")
    save_camera(made.folder / "east.yaml", CAMERA)
    made.setup = made.folder / "setup.yaml"
    content = {
        "scenario": "hall",
        "runs": [{"arrivals": "arrivals.csv", "method": "karto", "mode": "without-map", "rounds": 3}],
        "waypoints": [[10.0, 5.0, 0.0], [12.0, 5.0, 90.0], [14.0, 5.0, 0.0]],
        "pause": PAUSE,
        "tag": {"id": TAG, "size": SIZE},
        "cameras": [
            {
                "name": "east",
                "images": "east",
                "calibration": "east.yaml",
                "image_kind": "raw",
                "clock_offset": 0.4,
                "waypoints": [1, 2],
            }
        ],
    }
    made.setup.write_text(yaml.safe_dump(content))
    return made


def spread(poses: list[SE2]) -> float:
    points = np.array([(at.x, at.y) for at in poses])
    return float(np.linalg.norm(points - points.mean(axis=0), axis=1).mean())


def test_outside_in_gives_the_true_precision_and_leaves_out_the_waypoint_without_a_camera(tour, tmp_path):
    (run,) = measure_outside_in(load_setup(tour.setup, OutsideInSetup), tmp_path)
    assert run.counts == {Verdict.MEASURED: 6}
    assert list(run.unjudged) == [2]
    (metrics,) = evaluate_runs([tmp_path]).runs
    for goal in (0, 1):
        true = spread([tour.truth[number, goal] for number in range(3)])
        assert metrics.waypoints[goal].position.precision_m == pytest.approx(true, abs=0.5e-3)
