"""Whole measurements on rendered pictures of known poses: from image folders and logs to metrics."""

import math
import shutil
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

from taskslam.errors import DetectorError, InputError
from taskslam.evaluation import evaluate_runs
from taskslam.geometry import SE2, rotation_from_rpy, wrap_angle
from taskslam.realworld.association import Verdict
from taskslam.realworld.cameras.camera_files import save_camera
from taskslam.realworld.cameras.camera_model import Camera
from taskslam.realworld.looks import image_frames, look_through
from taskslam.realworld.measure import MeasuredRun, measure_outside_in
from taskslam.realworld.measured_file import load_measured
from taskslam.realworld.setup_file import OutsideInSetup, load_setup
from taskslam.realworld.tags.detector import Detector
from taskslam.realworld.tags.tag_family import code_cells
from taskslam.realworld.tags.tag_plane import TagPlane
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


def measured(tour: Tour, out: Path, setup: Path | None = None, **options: bool) -> MeasuredRun:
    (run,) = measure_outside_in(load_setup(setup or tour.setup, OutsideInSetup), out, **options)
    return run


def test_the_run_directory_keeps_verdicts_poses_and_pictures(tour, tmp_path):
    run = measured(tour, tmp_path)
    record = load_run(run.directory)
    assert (record.manifest.source, record.manifest.truth_frame) == ("measured", "waypoint")
    kept = load_measured(record)
    assert kept is not None
    assert kept.clock_offsets == {"east": 0.4}
    assert kept.planes[0].height == pytest.approx(2.1, abs=0.02)
    for row in kept.arrivals:
        true = tour.truth[row.round, row.goal]
        assert math.hypot(row.pose[0] - true.x, row.pose[1] - true.y) < 0.01
        assert abs(wrap_angle(row.pose[2] - true.theta)) < 0.01
        assert Image.open(run.directory / "measured" / row.picture).size[0] == 360
        assert row.frames == 5


def test_the_published_way_measures_the_same_images_in_the_frame_of_the_camera(tour, tmp_path):
    ours, published = measured(tour, tmp_path / "a"), measured(tour, tmp_path / "b", published=True)
    assert published.counts == ours.counts
    true = spread([tour.truth[number, 0] for number in range(3)])
    off = [abs(spread([f.pose for f in run.arrivals if f.arrival.goal == 0]) - true) for run in (ours, published)]
    assert off[0] < off[1]


def test_an_hour_between_the_clocks_is_named_and_the_offset_that_heals_it_given(tour, tmp_path):
    with pytest.raises(InputError, match=r"camera east.*1 h behind \(a time zone or summer time\).*or to `estimate`"):
        measured(tour, tmp_path, tour.change(camera__clock_offset=3600.4))
    run = measured(tour, tmp_path, tour.change(camera__clock_offset="estimate"))
    assert run.counts == {Verdict.MEASURED: 6}
    assert any("its clock is" in note for note in run.notes)
    found = load_measured(load_run(run.directory)).clock_offsets["east"]
    assert found == pytest.approx(0.4, abs=0.5)  # an image a second


def test_a_place_in_the_map_gives_accuracy(tour, tmp_path):
    measured(tour, tmp_path, tour.change(camera__place={"x": 1.0, "y": 2.0, "heading": 90}))
    (metrics,) = evaluate_runs([tmp_path]).runs
    goal = SE2(*metrics.waypoints[0].target)
    seen = [SE2(1, 2, math.pi / 2) @ tour.truth[number, 0] for number in range(3)]
    assert metrics.waypoints[0].position.accuracy_m == pytest.approx(
        np.mean([pose.distance_to(goal) for pose in seen]), abs=0.005
    )


@pytest.mark.parametrize(
    ("keys", "complaint"),
    [
        ({"tag": {"id": 8, "size": SIZE}}, r"none of 48 images shows tag 8; seen: 7 \(\d+ times\)"),
        ({"camera__images": "nowhere"}, "nowhere: cannot list the pictures"),
        ({"camera__images": "."}, "holds no image"),
        ({"camera__calibration": "none.yaml"}, "none.yaml"),
        ({"camera__calibration": "small.yaml"}, r"640 x 480 px, but camera 'small' was calibrated at 320 x 240"),
        ({"camera__waypoints": [9]}, "names waypoint 9; the run of karto has 3"),
        ({"camera__clock_offset": "estimate", "pause": 400.0}, "cannot be estimated"),
    ],
)
def test_what_cannot_be_measured_is_one_sentence(tour, tmp_path, keys, complaint):
    save_camera(tour.folder / "small.yaml", Camera.pinhole("small", 320, 240, 260.0))
    with pytest.raises(InputError, match=complaint):
        measured(tour, tmp_path, tour.change(**keys))
    assert not list(tmp_path.rglob("run.json"))


def test_broken_and_foreign_images_cost_themselves_alone(tour, tmp_path):
    """A cut JPEG in one pause, no image at all in another, a second tag of the same id in a third, equal stamps."""
    folder = tmp_path / "tour"
    shutil.copytree(tour.folder, folder)
    rows = [row.split(",") for row in (folder / "arrivals.csv").read_text().splitlines()[1:]]
    pauses = [
        [p for p in sorted((folder / "east").iterdir()) if 0 <= float(t) + 0.4 - float(p.stem) <= PAUSE]
        for t, *_ in rows
    ]
    first = pauses[0][2]
    first.write_bytes(first.read_bytes()[:3000])
    for path in pauses[1]:
        path.unlink()
    picture = np.array(Image.open(pauses[2][2]))
    with Detector() as detector:
        (tag,) = detector.detect(picture)
    (left, top), (right, bottom) = tag.corners.min(axis=0).astype(int) - 8, tag.corners.max(axis=0).astype(int) + 8
    elsewhere = 20 if left > 320 else 640 - 20 - (right - left)
    picture[top:bottom, elsewhere : elsewhere + right - left] = picture[top:bottom, left:right]
    for path in pauses[2]:
        Image.fromarray(picture).save(path)
    shutil.copy(pauses[3][0], pauses[3][0].with_name(f"copy_{pauses[3][0].name}"))
    run = measured(Tour(folder, tour.truth, folder / "setup.yaml"), tmp_path / "out")
    found = {(a.arrival.round, a.arrival.goal): a for a in run.arrivals}
    assert found[0, 0].verdict is Verdict.MEASURED
    assert found[0, 0].frames == 4
    assert found[0, 1].verdict is Verdict.AMBIGUOUS
    assert "took no image during the pause; the nearest" in found[0, 1].reason
    assert found[1, 0].verdict is Verdict.AMBIGUOUS
    assert "tag 7 was found 2 times" in found[1, 0].reason
    assert found[1, 1].verdict is Verdict.MEASURED
    assert any("1 of 44 images could not be used" in note and first.name in note for note in run.notes)


def test_a_robot_that_is_not_where_it_says_is_not_seen_and_counts_against_it(tour, tmp_path):
    """Its tag is covered in round 2 at waypoint 1: the camera looks, and there is none."""
    folder = tmp_path / "tour"
    shutil.copytree(tour.folder, folder)
    stamp = float((folder / "arrivals.csv").read_text().splitlines()[3].split(",")[0])
    for path in (folder / "east").iterdir():
        if 0 <= stamp + 0.4 - float(path.stem) <= PAUSE:
            Image.fromarray(np.full((480, 640), 90, np.uint8)).save(path)
    run = measured(Tour(folder, tour.truth, folder / "setup.yaml"), tmp_path / "out")
    assert run.counts == {Verdict.MEASURED: 5, Verdict.NOT_SEEN: 1}
    (metrics,) = evaluate_runs([tmp_path / "out"]).runs
    assert (metrics.complete_waypoints, metrics.planned_waypoints) == (1, 2)
    (failure,) = [one for one in metrics.failures if one.outcome == "not_seen"]
    assert (failure.round, failure.goal) == (1, 0)
    assert "tag 7 was not found in 17000" in failure.detail


def test_a_detector_that_dies_over_an_image_is_named_and_the_rest_goes_on(tour, tmp_path, monkeypatch):
    frames = image_frames(tour.folder / "east")[:4]
    detect = Detector.detect

    def dies(self: Detector, image: np.ndarray, name: str = "image") -> list:
        if name == frames[1].path.name:
            raise DetectorError(f"{name}: the tag detector died twice over this image")
        return detect(self, image, name)

    monkeypatch.setattr(Detector, "detect", dies)
    with Detector() as detector:
        looks = look_through(frames, CAMERA, detector, {TAG}, 2.2)
    assert [look.problem is None for look in looks] == [True, False, True, True]
    assert frames[1].path.name in looks[1].problem
