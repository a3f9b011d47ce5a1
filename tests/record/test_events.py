import contextlib
import dataclasses
import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.errors import RecordError
from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.record.events import EVENT_TYPES, Arrival, GoalFailed, GoalStarted, RoundEnded, decode_event, encode_event

finite = st.floats(-1e49, 1e49)


def test_every_event_comes_back_as_it_was(events):
    assert {type(event) for event in events} == set(EVENT_TYPES.values())
    for event in events:
        assert decode_event(encode_event(event)) == event


def test_a_line_has_sorted_keys_and_no_line_end_inside(events):
    for event in events:
        line = encode_event(event)
        assert "\n" not in line
        assert list(json.loads(line)) == sorted(json.loads(line))


@given(finite, finite, finite)
def test_floats_come_back_bit_for_bit(x, y, theta):
    event = GoalStarted(0, 0, 0, SE2(x, y, theta))
    back = decode_event(encode_event(event)).target
    assert [v.hex() for v in (back.x, back.y, back.theta)] == [float(v).hex() for v in (x, y, theta)]


def test_numpy_scalars_write_the_same_bytes_as_python_numbers():
    plain = RoundEnded(5, 1, Outcome.LOST, 7, 0)
    numpy = RoundEnded(np.int64(5), np.int32(1), Outcome.LOST, np.int64(7), np.uint8(0))
    assert encode_event(numpy) == encode_event(plain)
    pose = SE2(np.float64(0.1), np.float64(0.2), np.float64(0.3))
    assert encode_event(GoalStarted(0, 0, 0, pose)) == encode_event(GoalStarted(0, 0, 0, SE2(0.1, 0.2, 0.3)))


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["target", "truth", "estimate", "odometry"])
def test_a_pose_that_is_not_finite_is_refused(bad, field):
    event = Arrival(0, 0, 0, SE2(), SE2(), SE2(), SE2())
    with pytest.raises(RecordError, match=f"arrival: field '{field}': expected a finite pose"):
        encode_event(dataclasses.replace(event, **{field: SE2(0.0, bad, 0.0)}))


def test_a_time_in_seconds_is_refused():
    with pytest.raises(RecordError, match="field 't'"):
        encode_event(RoundEnded(1.5, 0, Outcome.REACHED, 0, 0))


def test_undecodable_output_of_a_guest_can_be_written():
    event = GoalFailed(0, 0, 0, SE2(), Outcome.CRASHED, b"\xff".decode("utf-8", "surrogateescape"), None, None, None)
    encode_event(event).encode("utf-8")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("", "expected one JSON object"),
        ("[1]", "found list"),
        ('{"t": 1}', "unknown event None"),
        ('{"event": "arival", "t": 1}', "Did you mean 'arrival'"),
        ('{"event": "run_ended", "t": 1}', "expected the fields"),
        ('{"event": "run_ended", "t": 1, "complete": true, "wall": 3}', "expected the fields"),
        ('{"event": "run_ended", "t": 1, "complete": 1}', "expected true or false"),
        ('{"event": "run_ended", "t": NaN, "complete": true}', "expected value at line 1 column 29"),
        ('{"event": "run_ended", "t": -1, "complete": true}', "expected an integer from 0"),
        ('{"event": "run_ended", "t": true, "complete": true}', "expected an integer"),
        ('{"event": "goal_started", "goal": 0, "round": 0, "t": 0, "target": [1, 2]}', r"expected \[x, y, theta\]"),
        ('{"event": "goal_started", "goal": 0, "round": 0, "t": 0, "target": [1, 2, 1e999]}', "three finite numbers"),
        ('{"event": "goal_started", "goal": 0, "round": 0, "t": 0, "target": [1, 2, "3"]}', "three finite numbers"),
        (
            '{"event": "round_ended", "dropped_frames": 0, "frames": 0, "outcome": "bored", "round": 0, "t": 0}',
            "'bored' is not a valid Outcome",
        ),
        ("[" * 100_000, "expected one JSON object"),
    ],
)
def test_a_wrong_line_is_refused_with_a_reason(line, message):
    with pytest.raises(RecordError, match=message):
        decode_event(line)


@given(st.text())
def test_no_text_raises_anything_but_a_record_error(text):
    with contextlib.suppress(RecordError):
        decode_event(text)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("round", 10**9, "expected a round from 0 to 1000"),
        ("goal", 10**9, "expected a goal below 10000"),
        ("t", 10**400, "expected an integer from 0 to 9223372036854775807, found more"),
        ("target", [10**400, 0, 0], "expected three finite numbers"),
        ("target", [1e300, 0.0, 0.0], "expected three finite numbers"),
    ],
)
def test_a_number_beyond_all_bounds_is_refused(field, value, message):
    line = {"event": "goal_started", "t": 1, "round": 0, "goal": 0, "target": [0.0, 0.0, 0.0]} | {field: value}
    with pytest.raises(RecordError, match=message):
        decode_event(json.dumps(line))
