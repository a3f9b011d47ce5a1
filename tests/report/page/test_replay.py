"""What the page plays of a tour: read back here, and driven by keyboard in a real browser."""

import json
import math

import numpy as np
import pytest

from browser import DESKTOP, PHONE, act, needs_chromium
from taskslam.measurements import NANOSECONDS
from taskslam.record import Trajectory, load_run
from taskslam.report import write_report
from taskslam.report.floor import floor_plan
from taskslam.report.page import page as page_module
from taskslam.report.page import replay
from taskslam.report.page.replay import STEP, coded, kept_on_page, replay_of
from taskslam.report.poses_over_time import poses_at
from taskslam.report.tracks import Tracks

_LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"


def decoded(stretches, samples):
    """As the docstring of the coder has it, written once more from that."""
    poses = np.full((samples, 3), np.nan)
    for first, count, code in stretches:
        numbers, value, shift = [], 0, 0
        for letter in code:
            digit = _LETTERS.index(letter)
            value |= (digit & 31) << shift
            shift += 5
            if digit < 32:
                numbers.append(-(value + 1) // 2 if value & 1 else value // 2)
                value, shift = 0, 0
        second = np.array(numbers).reshape(count, 3)
        poses[first : first + count] = np.cumsum(np.cumsum(second, axis=0), axis=0) * STEP
    return poses


def replayed(directory):
    record = load_run(directory)
    tracks = Tracks(record)
    names = [f"round {start.round + 1}" for start in record.rounds()]
    return record, tracks, replay_of(record, floor_plan(directory), tracks, names)


def test_a_coded_track_is_read_back_within_half_a_millimetre_with_its_gaps():
    rng = np.random.default_rng(1)
    poses = np.cumsum(rng.normal(0, 0.02, (400, 3)), axis=0)
    poses[:3] = np.nan
    poses[100:130] = np.nan
    poses[200] = np.nan
    back = decoded(coded(poses), 400)
    assert np.array_equal(np.isnan(back), np.isnan(poses))
    assert np.nanmax(np.abs(back[:, :2] - poses[:, :2])) <= STEP / 2 + 1e-12
    turn = back[:, 2] - poses[:, 2]
    assert np.nanmax(np.abs(np.arctan2(np.sin(turn), np.cos(turn)))) <= STEP / 2 + 1e-12


def test_between_poses_far_apart_in_time_and_outside_a_track_nothing_is_known():
    track = Trajectory(
        np.array([1, 2, 12, 13]) * NANOSECONDS // 10,
        np.array([[0, 0, math.pi - 0.1], [1, 0, -math.pi + 0.1], [5, 0, 0], [6, 0, 0]], float),
    )
    found = poses_at(track, np.array([0, 15, 60, 120, 125, 131]) * NANOSECONDS // 100)
    assert np.isnan(found[[0, 2, 5]]).all()
    assert found[[1, 3, 4], 0].tolist() == pytest.approx([0.5, 5.0, 5.5])
    assert abs(found[1, 2]) == pytest.approx(math.pi)  # through the half turn, not through 0


def test_a_replay_holds_the_tour_as_it_was_recorded(make_run):
    _, tracks, found = replayed(make_run(failed=True, slam_off=0.5))
    data = json.loads(found.data)
    first, last = data["rounds"][0], data["rounds"][-1]
    assert [round_["name"] for round_ in data["rounds"]] == ["round 1", "round 2", "round 3"]
    stamps = np.arange(first["count"]) * NANOSECONDS // 10
    truth = poses_at(tracks.get(0, "truth"), stamps)
    assert np.nanmax(np.abs(decoded(first["truth"], first["count"]) - truth)) <= STEP / 2 + 1e-9
    assert [event[1:3] for event in first["events"]] == [[k, g] for g in (1, 2, 3) for k in ("goal", "arrival")]
    failure = last["events"][-1]
    assert failure[1:4] == ["failure", 3, "no path to the goal"]
    assert failure[4:] == pytest.approx([6.0 - 1 + 29 / 30, 4.0], abs=1e-3)
    assert "<" not in found.data


def test_without_trajectories_there_is_nothing_to_play(make_run):
    directory = make_run()
    for file in directory.glob("round*/*.tum"):
        file.unlink()
    assert replayed(directory)[2] is None


def test_a_tour_that_takes_too_much_is_read_less_often(make_run, monkeypatch):
    directory = make_run()
    whole = replayed(directory)[2]
    monkeypatch.setattr(replay, "MOST_OF_A_RUN", whole.size - 1)
    fewer = replayed(directory)[2]
    assert json.loads(fewer.data)["rate"] < json.loads(whole.data)["rate"]
    assert fewer.size < whole.size
    monkeypatch.setattr(replay, "MOST_OF_A_RUN", 100)
    assert replayed(directory)[2] is None


def test_a_page_keeps_the_first_replays_that_fit_and_names_how_many_do_not(make_run, tmp_path, monkeypatch):
    make_run("a")
    make_run("b", mode="with-map")
    one = replayed(tmp_path / "results/a")[2]
    assert kept_on_page([one, None, one, one], 2 * one.size) == [one, None, one, None]
    monkeypatch.setattr(page_module, "kept_on_page", lambda replays: kept_on_page(replays, one.size))
    text = write_report([tmp_path / "results"], tmp_path / "report.html").read_text()
    assert text.count('<input type="range"') == 1
    assert "1 of 2 runs, the last ones" in text
    assert "taskslam report " in text


_SEEN = """
  const at = (selector) => document.querySelector(".replay " + selector);
  document.querySelector(".replay").scrollIntoView();
  at(".time").focus();
  const press = (key, more = {}) => document.activeElement.dispatchEvent(
    new KeyboardEvent("keydown", {key, bubbles: true, cancelable: true, ...more}));
  const until = async (holds) => {
    for (let tries = 0; tries < 3000 && !holds(); tries++) await new Promise((go) => setTimeout(go, 5));
  };
  const painted = () => {
    const canvas = at("canvas");
    const copy = document.createElement("canvas");
    [copy.width, copy.height] = [canvas.width, canvas.height];
    const brush = copy.getContext("2d", {willReadFrequently: true});
    brush.drawImage(canvas, 0, 0);
    return brush.getImageData(0, 0, copy.width, copy.height).data.filter((v, i) => i % 4 === 3 && v).length;
  };
"""


@pytest.fixture(scope="class")
def page(tmp_path_factory, write_synthetic_run):
    folder = tmp_path_factory.mktemp("replay")
    rig = {"lidar_2d": {"mount": {"xyz": [0, 0, 0.4]}, "rate": 10, "samples": 100, "angle_min": -3.14,
                        "angle_max": 3.14, "range_min": 0.1, "range_max": 20, "noise": 0.01}}  # fmt: skip
    write_synthetic_run(folder / "results/one", failed=True, slam_off=0.5, robot={"rig": rig})
    return write_report([folder / "results"], folder / "report.html")


@needs_chromium
def test_the_keyboard_reaches_every_moment(page):
    seen = act(
        page,
        DESKTOP,
        _SEEN
        + """
        const said = [];
        const words = () => [".said-now", ".clock"].map((name) => at(name).textContent);
        const note = () => said.push([Number(at(".time").value), ...words()]);
        note(); press("ArrowRight"); note(); press("ArrowRight", {shiftKey: true}); note();
        press("ArrowLeft"); note(); press("End"); note(); press("Home"); note();
        document.getElementById("unit-tu").click(); press("ArrowRight"); note();
        return said;""",
    )
    times, words, clocks = zip(*seen, strict=True)
    assert times == pytest.approx([0, 1, 9.0, 8.0, 9.0, 0, 1], abs=0.11)
    assert words[1] == "Drives to waypoint 1 · SLAM 1.00 cm and 0.00° off"
    assert words[4].startswith("Stands at waypoint 3")
    assert words[6] == "Drives to waypoint 1 · SLAM 0.0333 D and 0.0000 FoV off"
    assert clocks[1] == "0:01 / 0:09"


@needs_chromium
def test_space_plays_to_the_end_and_the_robot_is_drawn_with_its_scan(page):
    bare, scanned, playing, ended, end = act(
        page,
        PHONE,
        _SEEN
        + """
        at(".scan").checked = false; at(".time").focus(); press("ArrowRight");
        const bare = painted();
        at(".scan").checked = true;
        await until(() => { press("ArrowRight"); press("ArrowLeft"); return painted() > bare; });
        const scanned = painted();
        requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 16);  // virtual time has no frames
        at(".speed").value = "16";
        press(" ");
        const playing = at(".play").textContent;
        await until(() => at(".play").textContent === "Play");
        return [bare, scanned, playing, Number(at(".time").value), Number(at(".time").max)];""",
    )
    assert bare > 50
    assert scanned > bare
    assert playing == "Pause"
    assert ended == end > 8


@needs_chromium
def test_a_failure_is_watched_from_its_story(page):
    round_, before, said = act(
        page,
        DESKTOP,
        _SEEN
        + """
        document.querySelector("[data-replay]").click();
        const before = Number(at(".time").value);
        press("End");
        return [at(".which").value, before, at(".said-now").textContent];""",
    )
    assert round_ == "2"
    assert before == 0.0
    assert said.startswith("Waypoint 3 failed: no path to the goal")
