"""Whatever a method does, it is contained and named, and the rounds after are driven (design D13)."""

from __future__ import annotations

import json
import sys
import zlib
from pathlib import Path

import pytest

from adversaries.traces import LIMITS, TORTURE, Traces, impatient
from taskslam.benchmark.run import run
from taskslam.benchmark.stage import Stage
from taskslam.errors import InputError, TaskSlamError
from taskslam.mode import Mode
from taskslam.outcomes import Outcome
from taskslam.record.events import GoalFailed, MethodNotice, RoundEnded
from taskslam.record.run_directory import RunRecord, load_run
from taskslam.slam.cards import card_of

sys.path.insert(0, str(Path(__file__).parent / "guests"))
from acts import ACTS
from adversary import STRANGE

sys.path.pop(0)

OURS = {Outcome.CRASHED, Outcome.STALLED, Outcome.INVALID_OUTPUT}
PLACES = ("start", "feed", "stop", "construct")
ROUNDS = 2


def some(act: str, place: str) -> bool:
    """Whether this one is tried in the test command too: a third of the acts, each at some place."""
    return TORTURE or PLACES[zlib.crc32(act.encode()) % 12 :][:1] == (place,)


TRIED = [(act, place) for act in ACTS for place in PLACES if some(act, place)]


def test_there_are_enough_adversaries() -> None:
    assert len(ACTS) * len(PLACES) + len(ACTS) + len(STRANGE) >= 120


@pytest.fixture
def stage(make_stage) -> Stage:
    """A tour of one near goal."""
    made: Stage = make_stage([[-1.6, -1.0, 0.0]], rounds=ROUNDS, pause=0.1, still_start=0.1)
    return made


def tour(stage: Stage, out: Path, act: str, place: str) -> RunRecord:
    """The finished run of a method that does an act at a place."""
    spec = stage.spec("adversary:Adversary", Mode.WITHOUT_MAP, options={"act": act, "place": place})
    directory, _ = run(stage, spec, out, limits=impatient(place))
    return load_run(directory)


def failures(record: RunRecord) -> list[Outcome]:
    """How the goals of a run failed."""
    return [event.outcome for event in record.events if isinstance(event, GoalFailed)]


@pytest.mark.parametrize(("act", "place"), TRIED)
def test_an_act_is_contained_and_named_and_every_round_is_driven(
    act: str, place: str, stage: Stage, guests: Path, own_temporary_folder: Path, tmp_path: Path
) -> None:
    before = Traces.now()
    refused = None
    try:
        record = tour(stage, tmp_path / "out", act, place)
    except TaskSlamError as error:
        refused = error
    if refused is not None:
        # The user's fault, as far as anybody can tell: the very first start, and a sentence that a terminal can show.
        assert refused.exit_status == 2, refused
        assert place in ("construct", "start")
        assert str(refused).isprintable()
    else:
        ended = [event for event in record.events if isinstance(event, RoundEnded)]
        assert len(ended) == ROUNDS
        assert set(failures(record)) <= OURS
        if record.manifest.complete:
            assert not failures(record)
        else:
            assert len(failures(record)) == ROUNDS
            assert record.manifest.failure is not None
            assert record.manifest.failure.isprintable()
        json.loads((record.directory / "run.json").read_text())
    assert Traces.now().beyond(before) == []


@pytest.mark.parametrize("act", [*STRANGE] if TORTURE else [*STRANGE][::2])
def test_a_strange_answer_is_invalid_output_in_every_round(
    act: str, stage: Stage, guests: Path, tmp_path: Path
) -> None:
    record = tour(stage, tmp_path, act, "feed")
    assert failures(record) == [Outcome.INVALID_OUTPUT] * ROUNDS


@pytest.mark.parametrize(
    ("act", "words"),
    [("segfault", "SIGSEGV"), ("exits_at_once_137", "code 137"), ("hangs", "no answer"), ("raises", "match")],
)
def test_a_failure_while_it_is_stopped_is_a_notice_and_stands_in_run_json(
    act: str, words: str, stage: Stage, guests: Path, tmp_path: Path
) -> None:
    record = tour(stage, tmp_path, act, "stop")
    assert record.manifest.complete
    assert len(record.manifest.stop_failures) == ROUNDS
    assert all(words in told for told in record.manifest.stop_failures)
    assert sum(isinstance(e, MethodNotice) and words in e.text for e in record.events) == ROUNDS


IMPORTED = [
    "exits_0",
    "exits_at_once_0",
    "segfault",
    "raises_escapes",
    "patches_python",
    "hangs",
    "forges_an_input_error",
]


@pytest.mark.parametrize("act", [*ACTS] if TORTURE else IMPORTED)
def test_an_act_while_it_is_imported_ends_no_benchmark(
    act: str, stage: Stage, guests: Path, own_temporary_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from taskslam.slam import cards

    monkeypatch.setattr(cards, "_LIMITS", impatient("feed"))
    monkeypatch.setenv("TASKSLAM_METHOD_IMPORT", act)
    before = Traces.now()
    try:
        said = card_of("adversary:Adversary").name
    except InputError as error:
        said = str(error)
    assert "adversary" in said
    assert said.isprintable()
    assert Traces.now().beyond(before) == []


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("Patient", "still start"),
        ("Wordy", "version has 100000 characters"),
        ("Queueing", "queue"),
        ("Mistyped", "deterministic is 'perhaps'"),
    ],
)
def test_a_card_beyond_its_bounds_is_refused(name: str, words: str, guests: Path) -> None:
    with pytest.raises(InputError, match=words):
        card_of(f"adversary:{name}")


@pytest.mark.parametrize(
    ("name", "words"), [("Changing", "not the one that it was described by"), ("Truthful", "true poses")]
)
def test_a_card_that_changes_or_asks_for_the_truth_is_refused(
    name: str, words: str, stage: Stage, guests: Path, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=words):
        run(stage, stage.spec(f"adversary:{name}", Mode.WITHOUT_MAP), tmp_path, limits=LIMITS)
