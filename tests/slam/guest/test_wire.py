import contextlib
import itertools
import struct
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.geometry import SE2
from taskslam.measurements import ImuSamples, LaserScan, PointCloud, StereoImages, TruePose, WheelOdometry
from taskslam.processes import messages
from taskslam.slam.guest import wire

RNG = np.random.default_rng(0)
MEASUREMENTS = [
    LaserScan(10**18, RNG.random(7).astype("f4"), -1.5, 0.1, 0.1, float("inf"), 12345),
    PointCloud(5, RNG.random((6, 3)).astype("f4"), np.arange(6, dtype="u2"), np.arange(6, dtype="i4")),
    StereoImages(5, np.arange(12, dtype="u1").reshape(3, 4), np.zeros((3, 4, 3), dtype="u1")),
    ImuSamples(5, np.array([4, 5], dtype="i8"), RNG.random((2, 3)), RNG.random((2, 3))),
    WheelOdometry(5, SE2(0.1, -1e-17, 3.0000000000000004), 0.3, -0.1),
    TruePose(5, SE2(1.0, 2.0, 3.0)),
]


def read(data):
    return list(messages.MessageReader().messages(data))


@pytest.mark.parametrize("measurement", MEASUREMENTS, ids=lambda m: m.sensor)
def test_every_measurement_arrives_bit_for_bit(measurement):
    ((header, arrays),) = read(wire.pack_measurement(7, measurement))
    number, arrived = wire.unpack_measurement(header, arrays)
    assert number == 7
    assert type(arrived) is type(measurement)
    for name in measurement.__slots__:
        sent, got = getattr(measurement, name), getattr(arrived, name)
        if isinstance(sent, np.ndarray):
            assert (got.dtype, got.shape, got.tobytes()) == (sent.dtype, sent.shape, sent.tobytes())
            assert got.flags.writeable
        else:
            assert got == sent


@given(cuts=st.lists(st.integers(1, 400), max_size=20))
def test_messages_are_put_together_from_any_pieces(cuts):
    data = b"".join(wire.pack_measurement(n, m) for n, m in enumerate(MEASUREMENTS))
    reader, numbers = messages.MessageReader(), []
    edges = [0, *sorted({min(sum(cuts[:i]), len(data)) for i in range(1, len(cuts) + 1)}), len(data)]
    for begin, end in itertools.pairwise(edges):
        numbers += [header["number"] for header, _ in reader.messages(data[begin:end])]
    assert numbers == list(range(len(MEASUREMENTS)))


@given(st.binary(max_size=200))
def test_foreign_bytes_are_an_error_or_too_few(data):
    with contextlib.suppress(messages.WireError):
        assert read(data) == []


def framed(header: bytes, payload: bytes = b"") -> bytes:
    return struct.pack("<4sII", messages.MAGIC, len(header), len(payload)) + header + payload


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"Traceback (most recent call last)", "expected a message"),
        (framed(b"{oops"), "not JSON"),
        (framed(b"[1]"), "not a JSON object"),
        (framed(b'{"arrays":[["a","|O",[1]]]}', b"12345678"), "declaration"),
        (framed(b'{"arrays":[["a","<f4",[-1]]]}', b"1234"), "declaration"),
        (framed(b'{"arrays":[["a","<f4",[2.5]]]}', b"1234"), "declaration"),
        (framed(b'{"arrays":[["a","<f8",[99999999]]]}', b"1234"), "larger than the message"),
        (framed(b'{"arrays":[["a","<f4",[1]]]}', b"12345"), "declared by no array"),
        (framed(b'{"arrays":7}'), "not a list"),
        (struct.pack("<4sII", messages.MAGIC, 2**31, 0), "at most"),
        (struct.pack("<4sII", messages.MAGIC, 2, 2**31), "at most"),
    ],
)
def test_malformed_messages_are_refused(data, words):
    with pytest.raises(messages.WireError, match=words):
        read(data)


def test_a_measurement_with_the_wrong_dtype_does_not_travel():
    with pytest.raises(messages.WireError, match="ranges has dtype float64"):
        wire.pack_measurement(0, LaserScan(0, np.ones(3), 0.0, 0.1, 0.1, 10.0))


@pytest.mark.parametrize("header", [{"feed": "sonar"}, {"feed": "laser_scan", "number": 1, "values": {"stamp": "now"}}])
def test_what_is_not_a_measurement_is_refused(header):
    with pytest.raises(messages.WireError, match="not a measurement"):
        wire.unpack_measurement(header, {})


def test_messages_are_cheap():
    """An odometry message and a scan, packed and read: budgets many times above what an idle machine needs."""
    for measurement, budget in ((MEASUREMENTS[4], 100e-6), (LaserScan(0, np.ones(1024, "f4"), 0, 0.1, 0, 9.0), 250e-6)):
        reader, best = messages.MessageReader(), 1.0
        for _ in range(50):
            began = time.perf_counter()
            for header, arrays in reader.messages(wire.pack_measurement(1, measurement)):
                wire.unpack_measurement(header, arrays)
            best = min(best, time.perf_counter() - began)
        assert best < budget
