"""The virtual lab on a made-up tour of the built-in house: what a real tour would leave behind, and the truth of it."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from taskslam.errors import InputError, RecordError
from taskslam.evaluation.waypoints import position_precision
from taskslam.lab.folder import INSIDE_OUT, OUTSIDE_IN, write_logs
from taskslam.lab.lab_file import Lab, load_lab, shipped_labs
from taskslam.lab.tour import relive
from taskslam.lab.virtual_lab import outside_in, photograph, scenario_of
from taskslam.measurements import NANOSECONDS
from taskslam.mode import Mode
from taskslam.record import (
    Arrival,
    RunRecord,
    load_run,
)
from taskslam.robot import load_robot
from taskslam.scenario import load_scenario
from taskslam.simulation.rendering.scene import Scene
from taskslam.world.loading import load_world

Drive = Callable[..., RunRecord]

pytest.importorskip("apriltag", reason="needs the extra `apriltag`")
pytest.importorskip("cv2", reason="needs the extra `apriltag`")

ROUNDS = 3
VISITED = (0, 2, 3, 8, 11)  # goals of the house's tour, from 0
MISSED = (2, 11)  # round and goal that were never reached


@pytest.fixture(scope="module")
def lab(small_lab: Lab) -> Lab:
    return small_lab


@pytest.fixture(scope="module")
def run(drive: Drive, tmp_path_factory: pytest.TempPathFactory) -> RunRecord:
    return drive(tmp_path_factory.mktemp("run") / "run", VISITED, ROUNDS, missed=MISSED)


@pytest.fixture(scope="module")
def house():  # type: ignore[no-untyped-def]
    return load_world("house")


@pytest.fixture(scope="module")
def folder(run: RunRecord, house, lab: Lab, tmp_path_factory: pytest.TempPathFactory) -> Path:  # type: ignore[no-untyped-def]
    out = tmp_path_factory.mktemp("lab") / "lab"
    setups = photograph(run, house, load_robot("turtlebot2"), lab, out)
    assert [setup.name for setup in setups] == [OUTSIDE_IN, INSIDE_OUT]
    return out


def visits(record: RunRecord, goal: int) -> np.ndarray:
    """(M, 3) poses at a goal, NaN where it was not reached."""
    found = np.full((ROUNDS, 3), np.nan)
    for event in record.events:
        if isinstance(event, Arrival) and event.goal == goal and event.truth is not None:
            found[event.round] = event.truth.array()
    return found


def precision(record: RunRecord, goal: int) -> float:
    seen = visits(record, goal)
    return float(position_precision(seen[~np.isnan(seen).any(axis=1)][None])[0])


def test_every_picture_bears_its_time_and_lies_around_an_arrival(folder: Path, run: RunRecord, lab: Lab) -> None:
    pictures = list(csv.DictReader((folder / "truth" / "pictures.csv").open()))
    assert len(pictures) > 6 * len(VISITED) * ROUNDS * 0.8
    offsets = {camera.name: camera.clock_offset for camera in lab.cameras}
    ends = {(e.round, e.goal + 1): e.t / NANOSECONDS for e in run.events if isinstance(e, Arrival)}
    for row in pictures:
        path = folder / row["file"]
        assert path.is_file()
        taken = float(row["time"])
        if path.parent.name in offsets:
            assert float(path.stem) == pytest.approx(taken + offsets[path.parent.name], abs=1e-5)
        else:
            goal = int(row["waypoint"]) - 1
            assert path.name.startswith(f"up_g{goal}_l{row['round']}_")
        end = ends[int(row["round"]), int(row["waypoint"])] + lab.time_zero
        assert end - lab.photo.before - 0.2 <= taken <= end + lab.photo.after + 0.2
    written = {file.relative_to(folder).as_posix() for file in folder.rglob("*.jpg")}
    assert written == {row["file"] for row in pictures}


def test_the_logs_have_the_published_form(folder: Path, run: RunRecord, lab: Lab) -> None:
    first = np.loadtxt(folder / "trials" / "trial0" / "visited_waypoints_nav_info.txt")
    assert first.shape == (len(VISITED), 6)
    np.testing.assert_array_equal(first[:, 4], VISITED)
    arrivals = [event for event in run.events if isinstance(event, Arrival) and event.round == 0]
    np.testing.assert_allclose(first[:, 0] - lab.time_zero, [event.t / NANOSECONDS for event in arrivals], atol=1e-6)
    third = np.loadtxt(folder / "trials" / f"trial{MISSED[0]}" / "visited_waypoints.txt")
    assert len(third) == len(VISITED) - 1
    assert len(np.loadtxt(folder / "trials" / "trial0" / "planned_waypoints.txt")) == len(run.manifest.goals)


def test_with_map_all_rounds_are_loops_of_one_trial(run: RunRecord, lab: Lab, tmp_path: Path) -> None:
    with_map = replace(run, manifest=run.manifest.model_copy(update={"mode": Mode.WITH_MAP}))
    write_logs(relive(with_map, lab.sway.sway, 0), lab, tmp_path)
    assert [folder.name for folder in (tmp_path / "trials").iterdir()] == ["trial0"]
    info = np.loadtxt(tmp_path / "trials" / "trial0" / "visited_waypoints_nav_info.txt")
    np.testing.assert_array_equal(np.unique(info[:, 5]), range(ROUNDS))
    assert len(info) == ROUNDS * len(VISITED) - 1


@pytest.mark.parametrize(("direction", "goals"), [("outside", (0, 2, 11)), ("inside", (3, 8))])
def test_what_is_measured_agrees_with_the_truth(
    folder: Path, run: RunRecord, tmp_path: Path, direction: str, goals: tuple[int, ...]
) -> None:
    from taskslam.realworld.measure import measure_inside_out, measure_outside_in
    from taskslam.realworld.setup_file import InsideOutSetup, OutsideInSetup, load_setup

    if direction == "outside":
        measured = measure_outside_in(load_setup(folder / OUTSIDE_IN, OutsideInSetup), tmp_path)
    else:
        measured = measure_inside_out(load_setup(folder / INSIDE_OUT, InsideOutSetup), tmp_path)
    found = load_run(measured[0].directory)
    for goal in goals:
        true, seen = visits(run, goal), visits(found, goal)
        np.testing.assert_array_equal(np.isnan(seen), np.isnan(true))  # the same rounds, so the same completeness
        assert precision(run, goal) > 0.003
        assert precision(found, goal) == pytest.approx(
            precision(run, goal), abs=1e-3 if direction == "outside" else 2e-3
        )


def test_the_same_seed_gives_the_same_bytes(run: RunRecord, house, lab: Lab) -> None:  # type: ignore[no-untyped-def]
    camera = lab.cameras[0]
    scene, robot = Scene(house), load_robot("turtlebot2")

    def first(lab: Lab) -> bytes:
        return next(outside_in(relive(run, lab.sway.sway, lab.seed), scene, robot, lab, camera)).file

    assert first(lab) == first(lab)
    assert first(lab) != first(lab.model_copy(update={"seed": 1}))


def test_frames_are_lost_at_the_rate_that_is_asked_for(run: RunRecord, lab: Lab) -> None:
    from taskslam.lab.tour import shutters

    tour = relive(run, lab.sway.sway, 0)
    whole, half_of_it = (len(shutters(tour, VISITED, 20.0, 5.0, 1.0, dropped, 0, "camera")) for dropped in (0.0, 0.5))
    assert half_of_it == pytest.approx(0.5 * whole, rel=0.1)


@pytest.mark.parametrize("name", shipped_labs())
def test_shipped_labs_load_and_fit_their_scenarios(name: str) -> None:
    lab = load_lab(name)
    goals = load_scenario(lab.scenario).sequence.goals
    for camera in lab.cameras:
        assert lab.tag is not None
        for waypoint in camera.waypoints:  # the tag is in sight, away from the rim by more than the goal's tolerance
            at = goals[waypoint - 1]
            T_camera_map = np.linalg.inv(camera.mount.T_map_camera)
            ring = [
                (at.x + 0.3 * np.cos(a), at.y + 0.3 * np.sin(a), lab.tag.height, 1.0) for a in np.arange(0, 6.3, 0.5)
            ]
            pixels = camera.lens.camera(camera.name).project((np.array(ring) @ T_camera_map.T)[:, :3])
            assert (pixels > 0).all()
            assert (pixels < camera.lens.size).all()


def test_a_camera_looks_where_it_is_aimed() -> None:
    mount = load_lab("tsrb_short_cameras").cameras[2].mount
    T = mount.T_map_camera
    np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1)
    at = T[:3, 3] + T[:3, 2] * (mount.height - mount.aim_height) / -T[2, 2]
    np.testing.assert_allclose(at, [*mount.aim, mount.aim_height], atol=1e-12)
    assert T[2, 3] == pytest.approx(mount.height)
    assert np.degrees(np.arccos(-T[2, 2])) == pytest.approx(mount.tilt)
    assert -T[0, 1] > 0  # heading 0: the picture's top points along x


REFUSALS: list[tuple[Callable[[Lab], Lab], type[Exception], str]] = [
    (lambda lab: lab.model_copy(update={"scenario": "office"}), InputError, "a run of house, but lab"),
    (
        lambda lab: lab.model_copy(
            update={"cameras": (lab.cameras[0].model_copy(update={"waypoints": (13,)}),), "ceiling": None}
        ),
        InputError,
        "waypoint 13; the run has waypoints 1 to 12",
    ),
]


@pytest.mark.parametrize(("change", "error", "message"), REFUSALS)
def test_a_lab_that_does_not_fit_is_refused(
    run: RunRecord,
    house,
    lab: Lab,
    tmp_path: Path,
    change: Callable[[Lab], Lab],
    error: type[Exception],
    message: str,  # type: ignore[no-untyped-def]
) -> None:
    with pytest.raises(error, match=message):
        photograph(run, house, load_robot("turtlebot2"), change(lab), tmp_path / "out")


def test_pictures_are_never_mixed_with_other_files(run: RunRecord, house, lab: Lab, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(RecordError, match="exists already"):
        photograph(run, house, load_robot("turtlebot2"), lab, tmp_path)


def test_a_run_without_arrivals_is_refused(run: RunRecord, house, lab: Lab, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    without = replace(run, events=tuple(event for event in run.events if not isinstance(event, Arrival)))
    with pytest.raises(InputError, match="no arrival"):
        photograph(without, house, load_robot("turtlebot2"), lab, tmp_path / "out")


def test_a_run_that_was_not_simulated_is_refused(run: RunRecord) -> None:
    assert scenario_of(run) == load_scenario("house")
    manifest = run.manifest.model_copy(update={"scenario": {"sequence": run.manifest.scenario["sequence"]}})
    with pytest.raises(InputError, match="no scenario of a simulated run"):
        scenario_of(replace(run, manifest=manifest))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name: x\nscenario: house\n", "expected `tag` and `cameras`, or `ceiling`"),
        ("name: x\nscenario: house\ncamera: {}\n", "unknown key 'camera'; expected one of name, "),
        ("- 1\n", "not keys with values but a list"),
        (":\n\t", "not valid YAML"),
    ],
)
def test_a_wrong_lab_file_is_a_sentence(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "lab.yaml").write_text(text)
    with pytest.raises(InputError, match=message):
        load_lab(tmp_path / "lab.yaml")


def test_an_unknown_lab_is_named_with_a_guess() -> None:
    with pytest.raises(InputError, match="Did you mean 'tsrb_short_cameras'"):
        load_lab("tsrb_short_camera")
