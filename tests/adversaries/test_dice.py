"""A method knows the data sheet and never the dice (design D12)."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from adversaries.traces import TORTURE
from taskslam.benchmark import sealing
from taskslam.benchmark.run import run
from taskslam.benchmark.sealing import sealed
from taskslam.benchmark.spec import RunSpec
from taskslam.benchmark.stage import Stage
from taskslam.errors import InputError
from taskslam.evaluation import evaluate_runs
from taskslam.mode import Mode
from taskslam.processes import guest, landlock
from taskslam.record.events import Arrival
from taskslam.record.run_directory import load_run
from taskslam.robot import Imperfections
from taskslam.simulation.fitting import truly_mounted

SEED = 7316254  # of seven digits, so that it is found nowhere by chance
needs_wall = pytest.mark.skipif(not landlock.is_available(), reason="this kernel has no Landlock")


def estimation_error(directory: Path) -> float:
    """Largest distance in metres between true and estimated position at arrivals."""
    arrivals = [event for event in load_run(directory).events if isinstance(event, Arrival)]
    assert arrivals
    return max(a.truth.distance_to(a.estimate) for a in arrivals if a.truth and a.estimate)


@pytest.fixture
def stage(make_stage) -> Stage:
    made: Stage = make_stage([[2.5, -1.0, 0.0]], rounds=1)
    return made


def drive(stage: Stage, out: Path, method: str, salt: str | None = None, **options: object) -> Path:
    """The run of a method with this seed; sealed with a salt, if one is given."""
    spec = stage.spec(method, Mode.WITHOUT_MAP, SEED, options, sealed=salt is not None)
    return run(stage, spec, out, salt=salt)[0]


def drive_sealed(stage: Stage, out: Path) -> Path:
    """The sealed run of wheel odometry, with a secret of its own."""
    spec = stage.spec("wheel_odometry", Mode.WITHOUT_MAP, SEED, sealed=True)
    with sealed(out):
        return run(stage, spec, out)[0]


def test_noise_can_be_guessed_with_the_seed(stage: Stage, guests: Path, tmp_path: Path) -> None:
    """What sealing is for: somebody who knows the seed takes the noise off."""
    guessed = estimation_error(drive(stage, tmp_path, "dice:Dice", seed=SEED))
    assert guessed < 0.2 * estimation_error(drive(stage, tmp_path, "dice:Dice"))


@needs_wall
def test_sealed_noise_cannot_be_guessed(stage: Stage, guests: Path, tmp_path: Path) -> None:
    """The same noise for both, over several salts: what was never added can be taken off to no avail."""
    salts = [f"{number:02x}" * 32 for number in range(20 if TORTURE else 3)]
    guessed = [estimation_error(drive(stage, tmp_path / s[:2], "dice:Dice", s, seed=SEED)) for s in salts]
    honest = [estimation_error(drive(stage, tmp_path / s[:2], "dice:Dice", s)) for s in salts]
    print(f"guessed {sum(guessed) / len(salts):.4f} m, honest {sum(honest) / len(salts):.4f} m")
    assert sum(guessed) > (0.9 if TORTURE else 0.5) * sum(honest)


@needs_wall
def test_a_sealed_run_is_repeated_with_its_salt_byte_for_byte(stage: Stage, tmp_path: Path) -> None:
    first = drive_sealed(stage, tmp_path / "one")
    assert not list((tmp_path / "one").glob(".taskslam-seal"))
    manifest = load_run(first).manifest
    assert manifest.sealed
    assert manifest.salt is not None
    spec = stage.spec("wheel_odometry", Mode.WITHOUT_MAP, SEED, sealed=True)
    again, _ = run(stage, spec, tmp_path / "two", salt=manifest.salt)
    other = drive_sealed(stage, tmp_path / "three")
    for name in ("journal.jsonl", "round00/odometry.tum", "round00/estimate.tum", "spec.json"):
        assert (first / name).read_bytes() == (again / name).read_bytes(), name
    assert (first / "journal.jsonl").read_bytes() != (other / "journal.jsonl").read_bytes()
    assert load_run(other).manifest.spec_hash == manifest.spec_hash
    assert load_run(other).manifest.salt != manifest.salt


def test_a_finished_run_does_not_tell_the_salt_of_the_next(tmp_path: Path) -> None:
    one, two = sealing.salt_of(tmp_path, "a" * 64), sealing.salt_of(tmp_path, "b" * 64)
    assert one != two
    secret = (tmp_path / ".taskslam-seal").read_bytes()
    assert (tmp_path / ".taskslam-seal").stat().st_mode & 0o777 == 0o600
    assert secret.hex() not in one + two


def test_the_secret_stays_where_a_run_must_be_tried_again(tmp_path: Path) -> None:
    def interrupted() -> None:
        with sealed(tmp_path):
            raise KeyboardInterrupt

    before = sealing.salt_of(tmp_path, "a" * 64)
    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert sealing.salt_of(tmp_path, "a" * 64) == before


def test_sealing_is_refused_without_a_wall(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(landlock, "is_available", lambda: False)
    with pytest.raises(InputError, match="--sealed: this kernel has no Landlock"), sealed(tmp_path):
        pass


def test_a_planted_link_is_not_taken_for_the_secret(tmp_path: Path) -> None:
    (tmp_path / "known").write_bytes(bytes(32))
    (tmp_path / ".taskslam-seal").symlink_to(tmp_path / "known")
    with pytest.raises(InputError, match="secret"):
        sealing.salt_of(tmp_path, "a" * 64)


def wrong_of(stage: Stage) -> dict[str, dict[str, float]]:
    """What is wrong with the robot, part by part."""
    return {part: wrong for part, wrong in stage.robot.imperfections.model_dump().items() if wrong}


def secrets_of(stage: Stage, spec: RunSpec) -> list[bytes]:
    """What must not reach a child: the seed, the mode, the scenario, the results, and what is wrong with the robot."""
    keys = [f'"{key}"' for wrong in wrong_of(stage).values() for key in wrong]
    words = [str(SEED), spec.mode, "secret-scenario", "secret-results", '"carpets"', '"motors"', *keys]
    return [word.encode() for word in words]


def numbers_of(stage: Stage) -> set[float]:
    """By how much the robot is wrong, and where its LiDAR truly sits."""
    sheet, fitting = stage.robot.rig.lidar_2d, stage.robot.imperfections.fitting("lidar_2d")
    assert sheet is not None
    true = truly_mounted(sheet, fitting, SEED, "lidar_2d").mount
    drawn = {*true.xyz, *true.rpy}
    assert drawn.isdisjoint((*sheet.mount.xyz, *sheet.mount.rpy))
    return drawn | {value for wrong in wrong_of(stage).values() for value in wrong.values() if value}


def test_no_byte_that_reaches_a_child_tells_the_dice(
    stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Arguments, environment, messages, inherited descriptors and folder names of a real run, each read whole."""
    told: list[bytes] = []
    start, write = guest.subprocess.Popen, guest.GuestProcess.write

    def started(command, **more):
        told.extend(word.encode() for word in command)
        told.extend(f"{key}={value}".encode() for key, value in more["env"].items() if key != "PYTHONPATH")
        told.append(str(more["cwd"]).encode())
        told.extend(str(Path(f"/proc/self/fd/{number}").readlink()).encode() for number in more["pass_fds"])
        return start(command, **more)

    def written(self, data):
        told.append(bytes(data))
        write(self, data)

    monkeypatch.setattr(guest.subprocess, "Popen", started)
    monkeypatch.setattr(guest.GuestProcess, "write", written)
    monkeypatch.setenv("TASKSLAM_DATA", "secret-results")
    named = stage.scenario.model_copy(update={"name": "secret-scenario", "title": "secret-scenario"})
    wrong = {
        "odometry": {"gyro_bias": 0.000271, "scale": -0.00314, "slip": 0.00162, "gyro_walk": 0.0000173},
        "imu": {"gyro_bias": 0.000141, "accel_bias": 0.00732, "gyro_turn_on": 0.000619},
        "lidar_2d": {
            "misplaced": 0.00493,
            "misaligned": 0.00871,
            "late": 0.0193,
            "jitter": 0.00471,
            "reach_dark": 4.17,
        },
        "motors": {"lag": 0.0931, "deadband": 0.00917, "track": 0.2313},
        "carpets": {"size": 1.531, "share": 0.317, "scale": 0.0217, "drift": 0.00913},
    }
    robot = stage.robot.model_copy(update={"imperfections": Imperfections.model_validate(wrong)})
    stage = Stage(named, stage.world, stage.plan, robot)
    spec = stage.spec("karto", Mode.WITH_MAP, SEED)
    run(stage, spec, tmp_path / "secret-results")
    everything = b"\n".join(told)
    begun = everything[: everything.index(b'"feed"')]  # measurements hold numbers of every kind
    assert numbers_of(stage) & {float(word) for word in re.findall(rb"-?\d+\.\d+(?:e-?\d+)?", begun)} == set()
    assert b'"do":"start"' in everything
    assert b"gyro_noise" in everything
    assert [secret for secret in secrets_of(stage, spec) if secret in everything] == []


def test_run_json_of_an_open_run_has_no_salt(stage: Stage, tmp_path: Path) -> None:
    directory = drive(stage, tmp_path, "wheel_odometry")
    content = json.loads((directory / "run.json").read_text())
    assert content["sealed"] is False
    assert content["salt"] is None
    assert evaluate_runs([tmp_path]).runs
