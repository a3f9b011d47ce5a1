"""The pipe protocol of the bridge to ROS 2, without any ROS: what is no frame is refused, and nothing large is held."""

import io
import os
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.ros.ros2 import bridge_process as protocol

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(1 << 53), 1 << 53) | st.floats(allow_nan=False) | st.text(max_size=9),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=9,
)
HEADERS = st.dictionaries(st.text(max_size=8), VALUES, max_size=3)


def written(*frames):
    return b"".join(bytes(part) for header, body in frames for part in protocol.frame(header, body))


@given(
    st.lists(st.tuples(st.dictionaries(st.text(max_size=8), VALUES, max_size=4), st.binary(max_size=99)), max_size=5)
)
def test_frames_come_out_as_they_went_in(frames):
    stream = io.BytesIO(written(*frames))
    assert [protocol.read_frame(stream) for _ in frames] == frames
    assert protocol.read_frame(stream) is None


@given(st.binary(max_size=64))
def test_any_bytes_are_frames_or_are_refused(data):
    stream = io.BytesIO(data)
    try:
        while (said := protocol.read_frame(stream)) is not None:
            assert isinstance(said[0], dict)
    except protocol.BrokenFrameError:
        pass


def test_a_frame_that_declares_too_much_is_refused_before_it_is_read():
    lengths = protocol.LENGTHS.pack(2, protocol.LONGEST_BODY + 1)
    with pytest.raises(protocol.BrokenFrameError, match="expected at most"):
        protocol.read_frame(io.BytesIO(lengths + b"{}"))


def test_a_header_without_end_is_refused():
    said = b"[" * 100_000
    with pytest.raises(protocol.BrokenFrameError, match="no JSON"):
        protocol.read_frame(io.BytesIO(protocol.LENGTHS.pack(len(said), 0) + said))


def test_a_bridge_without_rclpy_says_so(tmp_path):
    """By an interpreter that sees no packages."""
    (tmp_path / "rclpy.py").write_text("raise ImportError('no rclpy here')")
    done = subprocess.run(
        [sys.executable, "-S", protocol.__file__, "x"],
        input=b"", capture_output=True, check=True, env={"PYTHONPATH": str(tmp_path), "PATH": os.defpath},
    )  # fmt: skip
    header, _ = protocol.read_frame(io.BytesIO(done.stdout))
    assert header["unable"].endswith("no rclpy here")


def test_the_bridge_imports_nothing_of_ours_nor_numpy():
    """It runs under the user's interpreter, which has neither."""
    check = "import runpy, sys; runpy.run_path(sys.argv[1], run_name='x'); print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-S", "-c", check, protocol.__file__], capture_output=True, check=True, text=True
    )
    assert not {"taskslam", "numpy", "rclpy"} & {name.partition(".")[0] for name in done.stdout.split()}
