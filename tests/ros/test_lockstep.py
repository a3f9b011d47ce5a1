"""The rules of lockstep, whatever is fed, whenever a node answers, and whatever it answers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.ros.encoding import Utterance
from taskslam.ros.lockstep import SAME, Answer, Answers, Lockstep, Rules
from taskslam.slam.base import InvalidOutputError, StalledError

MS = 1_000_000
PERIOD = 100 * MS
POSE = np.eye(4)


class Recorder:
    """A wire that writes down what is said, with a node behind it that answers frames as it was told to.

    delays: per frame how many looks for answers it takes, None for never; the wall's clock goes on with every look.
    """

    def __init__(self, delays, misstamped=(), works=lambda looks: 0.0):
        self.said, self.wall = [], 0.0
        self._delays, self._misstamped, self._works = iter(delays), misstamped, works
        self._due: list[tuple[float, Answer]] = []
        self._looks = 0

    def transforms(self, until):
        self.said.append(("transforms", until))

    def clock(self, now):
        self.said.append(("clock", now))

    def say(self, saying):
        self.said.append(("say", saying))
        if saying.messages:
            delay = next(self._delays)
            stamps = [saying.bears, *(saying.bears + off for off in self._misstamped)]
            if delay is not None:
                self._due += [(self._looks + delay, Answer(stamp, POSE)) for stamp in stamps]

    def hear(self, longest_s):
        self._looks += 1
        self.wall += longest_s
        heard = [answer for due, answer in self._due if due <= self._looks]
        self._due = [(due, answer) for due, answer in self._due if due > self._looks]
        return heard

    def worked(self):
        return self._works(self._looks)


def frame(stamp, bears=None):
    return Utterance(stamp, stamp if bears is None else bears, (("/scan", None),))


def odometry(stamp):
    return Utterance(stamp, stamp, ())


def feed(step, saying):
    return step.frame(saying, saying.bears, saying.stamp + PERIOD) if saying.messages else step.stream(saying)


def begun(wire, **rules):
    return Lockstep(wire, Rules(**{"longest_s": 0.2, "in_a_row": 10_000, **rules}), -1, lambda: wire.wall)


# Frames are a period apart, odometry anywhere between, the first rays of a scan up to 90 ms before its stamp.
DRIVES = st.lists(
    st.tuples(st.lists(st.integers(0, PERIOD - 1), max_size=4), st.integers(0, 90 * MS)), min_size=1, max_size=8
).map(
    lambda frames: [
        saying
        for index, (between, sweep) in enumerate(frames)
        for saying in (
            frame(index * PERIOD, index * PERIOD - sweep),
            *(odometry(index * PERIOD + at) for at in sorted(between)),
        )
    ]
)
DELAYS = st.lists(st.none() | st.integers(1, 250), min_size=8, max_size=8)


@given(DRIVES, DELAYS, st.integers(1, 40))
def test_the_clock_never_goes_back_and_stays_below_the_next_frame(drive, delays, tick_ms):
    wire = Recorder(delays)
    step = begun(wire, tick=tick_ms * MS)
    for saying in drive:
        feed(step, saying)
        following = -(-(saying.stamp + 1) // PERIOD) * PERIOD
        assert step.now < following
    clocks = [now for what, now in wire.said if what == "clock"]
    assert clocks == sorted(set(clocks))


@given(DRIVES, DELAYS)
def test_transforms_then_clock_then_sensor(drive, delays):
    wire = Recorder(delays)
    step = begun(wire)
    for saying in drive:
        feed(step, saying)
    shown, transformed = -1, -1
    for what, value in wire.said:
        if what == "transforms":
            transformed = value
        elif what == "clock":
            shown = value
        else:
            assert transformed == value.stamp
            assert shown >= value.stamp
    assert [value for what, value in wire.said if what == "say"] == drive


@given(DRIVES, DELAYS, st.lists(st.integers(-50 * MS, -2 * SAME), max_size=2))
def test_an_answer_belongs_to_the_frame_whose_stamp_it_bears(drive, delays, misstamped):
    """With instant frames: what is stamped between them belongs to none."""
    drive = [frame(saying.stamp) if saying.messages else saying for saying in drive]
    wire = Recorder(delays, misstamped)
    step = begun(wire)
    answers = [(saying, feed(step, saying)) for saying in drive if saying.messages or feed(step, saying)]
    for saying, answer in answers:
        assert answer is None or answer.stamp == saying.bears
    counts = step.counts
    assert counts.frames == len(answers) == counts.answered + counts.missing
    assert counts.answered == sum(answer is not None for _, answer in answers)
    assert counts.late <= counts.missing
    assert counts.unmatched == len(misstamped) * (counts.answered + counts.late)


@given(st.lists(st.integers(0, 90 * MS), min_size=1, max_size=8), st.floats(0, 1))
def test_an_answer_may_be_stamped_anywhere_in_the_sweep_of_its_frame(sweeps, share):
    """As a node does that carries its pose to the last point that it kept."""
    wire = Recorder([])
    step = begun(wire)
    for index, sweep in enumerate(sweeps):
        bears = index * PERIOD - sweep
        stamp = bears + round(share * sweep)
        wire.say = lambda saying: None
        wire.hear = lambda longest_s, stamp=stamp: [Answer(stamp, POSE)]
        assert feed(step, frame(index * PERIOD, bears)).stamp == stamp
    assert (step.counts.answered, step.counts.unmatched) == (len(sweeps), 0)


@given(DELAYS)
def test_only_an_answer_within_the_limit_is_one(delays):
    wire = Recorder(delays)
    step = begun(wire, longest_s=0.1, every_s=0.001)
    got = [feed(step, frame(index * PERIOD)) is not None for index in range(len(delays))]
    assert got == [delay is not None and delay <= 100 for delay in delays]


@given(st.integers(-SAME, SAME))
def test_a_stamp_that_lost_its_last_digits_is_the_same(off):
    wire = Recorder([None])
    wire.hear = lambda longest_s: [Answer(5 * PERIOD + off, POSE)]
    assert feed(begun(wire), frame(5 * PERIOD)) is not None


def test_the_clock_ticks_while_an_answer_is_waited_for():
    """A node that sleeps in simulated time needs them."""
    wire = Recorder([30])
    step = begun(wire, tick=2 * MS)
    feed(step, frame(PERIOD))
    assert [now for what, now in wire.said if what == "clock"] == [PERIOD + 2 * MS * i for i in range(30)]


def test_an_answer_of_the_future_is_none():
    wire = Recorder([1], misstamped=[2 * SAME])
    with pytest.raises(InvalidOutputError, match="newest frame that the node was given"):
        feed(begun(wire), frame(PERIOD))


def test_too_many_missing_answers_in_a_row_end_it():
    wire = Recorder([1, None, None, 1, None, None, None], misstamped=[-3 * MS])
    step = begun(wire, in_a_row=3)
    for index in range(6):
        feed(step, frame(index * PERIOD))
    with pytest.raises(StalledError, match=r"not answered 3 frames in a row .*5 missing.*-0\.003000 s"):
        feed(step, frame(6 * PERIOD))


def test_a_sparse_node_is_done_once_it_rests_after_the_last_tick():
    """It works for 60 looks after the clock has stopped, and answers nothing; the long limit is not waited for."""
    ticks = PERIOD // (10 * MS) - 1
    wire = Recorder([None], works=lambda looks: float(min(looks, ticks + 60)))
    step = begun(wire, tick=10 * MS, answers=Answers.SPARSE, quiet_s=0.02, longest_s=10.0)
    assert feed(step, frame(PERIOD)) is None
    assert step.counts.missing == 1
    assert 0.06 + 0.02 <= wire.wall < 0.2


@pytest.mark.parametrize("answers", list(Answers))
def test_time_in_which_we_were_stopped_does_not_count(answers):
    """Suspended with the node for an hour, between two looks: its answer still counts."""
    wire = Recorder([60])
    plain = wire.hear

    def hear(longest_s):
        if wire.wall and wire.wall < 3600.0:
            wire.wall += 3600.0
        return plain(longest_s)

    wire.hear = hear
    step = begun(wire, tick=90 * MS, answers=answers, quiet_s=0.12, longest_s=0.15)
    assert feed(step, frame(PERIOD)) is not None
    assert wire.wall > 3600.0


def test_only_the_first_frames_may_be_silent():
    """Three are passed over once the node rests; the fourth is waited for as long as any, and two such end it."""
    step = begun(wire := Recorder([None] * 5), silent_start=3 * PERIOD, quiet_s=0.01, longest_s=5.0, in_a_row=2)
    for index in range(3):
        feed(step, frame(index * PERIOD))
    assert wire.wall < 1.0
    feed(step, frame(3 * PERIOD))
    assert wire.wall > 5.0
    with pytest.raises(StalledError, match=r"not answered 2 frames in a row .*5 missing"):
        feed(step, frame(4 * PERIOD))


def test_a_sparse_node_is_never_given_up():
    step = begun(Recorder([None] * 30), answers=Answers.SPARSE, quiet_s=0.01, in_a_row=3)
    for index in range(30):
        feed(step, frame(index * PERIOD))
    assert step.counts.missing == 30
