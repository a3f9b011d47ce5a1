"""What a campaign's file may say, and what it means."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from taskslam.benchmark.campaign.campaign_file import load_campaign
from taskslam.benchmark.campaign.notes import keep, notes
from taskslam.benchmark.campaign.plan_file import read_plan, write_plan
from taskslam.benchmark.campaign.planning import Plan, plan
from taskslam.benchmark.campaign.price import Prices
from taskslam.benchmark.campaign.state import State, leftovers, states_of, strangers
from taskslam.benchmark.engine import Ending, Result, Watcher
from taskslam.benchmark.engines.local import LocalEngine
from taskslam.benchmark.spec import run_folder
from taskslam.errors import InputError, RecordError
from taskslam.mode import Mode
from taskslam.record.place import partial_folder


def planned(file: Path) -> Plan:
    return plan(load_campaign(str(file)))


def test_a_campaign_that_says_little_has_both_modes_and_three_seeds(
    write_campaign: Callable[..., Path], tmp_path: Path
) -> None:
    file = write_campaign("methods: [karto, wheel_odometry]")
    file.write_text(file.read_text().replace("modes: [without-map]\n", ""))
    specs = planned(file).specs
    assert len(specs) == 2 * 2 * 3
    assert [spec.method for spec in specs[:4]] == ["karto", "wheel_odometry"] * 2
    assert [spec.seed for spec in specs] == [0] * 4 + [1] * 4 + [2] * 4
    assert {spec.task.rounds for spec in specs} == {2}
    assert len({run_folder(tmp_path, spec) for spec in specs}) == len(specs)


def test_robots_latencies_and_options_each_have_a_place_of_their_own(
    write_campaign: Callable[..., Path], tmp_path: Path
) -> None:
    file = write_campaign(
        "methods: [karto, {name: karto, options: {do_loop_closing: false}}]",
        "robots: [turtlebot2, turtlebot2_vga15]",
        "latencies: [fixed, measured x 4]",
        "seeds: [0]",
    )
    specs = planned(file).specs
    assert len(specs) == 8
    assert len({run_folder(tmp_path, spec) for spec in specs}) == 8
    assert {spec.task.scenario.robot for spec in specs} == {"turtlebot2", "turtlebot2_vga15"}  # type: ignore[union-attr]
    assert specs[-1].way == "karto,do_loop_closing=false,measured x 4,robot=turtlebot2_vga15"


def test_what_is_excluded_is_not_driven_and_what_is_named_besides_is(
    write_campaign: Callable[..., Path], tour: Path
) -> None:
    file = write_campaign(
        "methods: [karto, wheel_odometry]",
        "modes: [without-map, with-map]",
        "seeds: [0, 1]",
        "exclude: [{method: wheel_odometry, mode: with-map}, {seed: [1], method: karto}]",
        f"runs: [{{scenario: {tour}, method: karto, seed: 7}}, {{scenario: {tour}, method: karto}}]",
    )
    told = [(spec.method, spec.mode, spec.seed) for spec in planned(file).specs]
    without, with_map = Mode.WITHOUT_MAP, Mode.WITH_MAP
    assert told == [
        ("karto", without, 0), ("wheel_odometry", without, 0), ("karto", with_map, 0), ("wheel_odometry", without, 1),
        ("karto", without, 7),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("sedes: [1]", r"unknown key 'sedes'.*Did you mean 'seeds'"),
        ("seeds: [-1]", r"seeds.0: .*greater than or equal to 0"),
        ("seeds: []", "seeds: "),
        ("exclude: [{metod: karto}]", r"unknown key 'exclude.0.metod'.*Did you mean 'exclude.0.method'|.*method"),
        ("exclude: [{method: wheel_odometri}]", r"exclude: the method 'wheel_odometri'.*Did you mean 'wheel_odometry'"),
        ("exclude: [{}]", "would leave out everything"),
        ("exclude: [{method: wheel_odometry}]", "no run is left to drive"),
        ("resources: {core: 2}", r"'resources.core'.*Did you mean 'resources.cores'|.*cores"),
        ("latencies: [slow]", "latency 'slow': expected fixed, zero, measured"),
        ("modes: [witout-map]", "modes.0"),
    ],
)
def test_a_wrong_file_is_refused_in_one_sentence(line: str, words: str, write_campaign: Callable[..., Path]) -> None:
    with pytest.raises(InputError, match=words):
        planned(write_campaign(line))


def test_a_plan_is_read_as_it_was_written(write_campaign: Callable[..., Path], tmp_path: Path) -> None:
    file = write_campaign(f"scenarios: [{tmp_path / 'tour.yaml'}, {tmp_path / 'nowhere.yaml'}]")
    campaign, made = load_campaign(str(file)), planned(file)
    path = write_plan(tmp_path / "out", campaign, made)
    kept = read_plan(tmp_path / "out")
    assert (kept.campaign, kept.plan.specs, kept.plan.folders) == (campaign, made.specs, made.folders)
    assert [result.detail for result in kept.plan.refused] == [result.detail for result in made.refused]
    assert path.read_text().count('"waypoints"') == 1  # a tour is written once, however often it is driven
    path.write_text(path.read_text().replace('"tour":0', '"tour":5', 1))
    with pytest.raises(RecordError, match="a run names tour 5 of 1"):
        read_plan(tmp_path / "out")
    with pytest.raises(RecordError, match="holds no campaign"):
        read_plan(tmp_path)


def test_the_state_of_a_campaign_is_what_stands_on_the_disk(
    write_campaign: Callable[..., Path], tmp_path: Path
) -> None:
    made, out = planned(write_campaign("seeds: [0, 1, 2, 3]", rounds=1)), tmp_path / "out"
    done, begun, failed, waiting = made.specs
    list(LocalEngine(1, made.folders).run([done], out, Watcher()))
    for spec in (begun, done):
        (partial_folder(run_folder(out, spec))).mkdir(parents=True)
        (partial_folder(run_folder(out, spec)) / "journal.jsonl").touch()
    keep(out, Result(failed.title, Ending.FAILED, "the node burnt", failed), "node7")
    states = states_of(made.specs, out)
    assert [one.state for one in states] == [State.FINISHED, State.UNDER_WAY, State.NOT_DRIVEN, State.WAITING]
    assert (states[2].note.detail, states[2].note.machine) == ("the node burnt", "node7")  # type: ignore[union-attr]
    assert leftovers(made.specs, out) == [partial_folder(run_folder(out, done))]
    assert strangers([begun, failed, waiting], out) == [run_folder(out, done)]
    keep(out, Result(failed.title, Ending.KEPT, "", failed))
    assert notes(out) == {}


def test_prices_rest_on_what_was_driven(write_campaign: Callable[..., Path], tmp_path: Path) -> None:
    made, out = planned(write_campaign("methods: [karto, wheel_odometry]", "seeds: [0, 1]", rounds=1)), tmp_path / "out"
    before = Prices(made.specs, out).of(made.specs[3])
    assert not before.measured
    assert before.core_s == pytest.approx(before.simulated_s / 40.0)  # a method of odometry alone, by the table
    (result,) = LocalEngine(1, made.folders).run([made.specs[1]], out, Watcher())
    assert result.ending is Ending.COMPLETE
    prices = Prices(made.specs, out)
    assert prices.of(made.specs[3]).measured
    assert not prices.of(made.specs[2]).measured  # no run of karto has shown how fast that is
    assert prices.of(made.specs[2]).simulated_s == prices.of(made.specs[3]).simulated_s
    assert [spec.method for spec in prices.cheapest_first(made.specs)] != [spec.method for spec in made.specs]


def test_stereo_with_fewer_pixels_costs_less(write_campaign: Callable[..., Path], tmp_path: Path) -> None:
    file = write_campaign("methods: [orb_slam3]", "robots: [turtlebot2, turtlebot2_small10]", "seeds: [0]")
    large, small = planned(file).specs
    prices = Prices((), tmp_path)
    assert prices.of(large).core_s > 5 * prices.of(small).core_s
