"""Whatever a trajectory file or a recording holds, its reader returns a trajectory or says in a sentence what is wrong.

A bounded budget of about twenty seconds; every example is small, so that memory is bounded by construction, and a
reader that took more for one would be seen: address space is limited while it runs.
"""

import resource
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from taskslam.datasets.trajectory_files import read_trajectory_file
from taskslam.errors import TrajectoryError
from taskslam.studies.study import load_study

ROOM = 2 * 2**30  # bytes more than the process has
relaxed = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])

number = st.one_of(
    st.floats().map(repr),
    st.integers(-(2**70), 2**70).map(str),
    st.sampled_from(
        ["", "-", ".", "1e", "1e999", "-0", "0x1", "1_0", "NaN", "inf", "1.5e-3", "9" * 400, "\u0663", "\x00"]
    ),
)
good = "1403636580.05 1 2 3 0 0 0 1"
line = st.one_of(
    st.lists(number, max_size=14).map(" ".join),
    st.lists(number, max_size=20).map(",".join),
    st.just(good),
    st.just(good.replace(" ", ",")),
    st.just("# comment"),
    st.text(max_size=40),
)
text = st.lists(line, max_size=12).flatmap(
    lambda lines: st.sampled_from(["\n", "\r\n", "\r"]).map(lambda end: end.join(lines).encode("utf-8", "replace"))
)


@contextmanager
def limited():
    """No more than ROOM of new address space."""
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (used + ROOM, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


def read_or_refuse(source, times=None):
    """Read; returns whether it could be. A trajectory that is returned keeps its promises."""
    try:
        with limited():
            trajectory = read_trajectory_file(str(source), times).trajectory
    except TrajectoryError as error:
        said = str(error)
    else:
        check(trajectory)
        return True
    assert said
    assert "\n" not in said
    return False


def check(trajectory):
    assert len(trajectory) > 0
    assert (np.diff(trajectory.stamps) > 0).all()
    assert np.isfinite(trajectory.positions).all()
    np.testing.assert_allclose(np.linalg.norm(trajectory.quaternions, axis=1), 1.0)


@settings(parent=relaxed, max_examples=250)
@given(content=st.one_of(text, st.binary(max_size=300)), name=st.sampled_from(["a.tum", "a.csv", "a.txt"]))
@example(content=(good + "\n").encode(), name="a.tum")
@example(content=b"1e400 0 0 0 0 0 0 1", name="a.tum")
@example(content=b"1e-999999999 0 0 0 0 0 0 1\n", name="a.tum")
@example(content=b"1e999999999 0 0 0 0 0 0 1\n", name="a.tum")
@example(content=b"1e99999999 0 0 0 0 0 0 1\n", name="a.tum")
def test_any_text(tmp_path, content, name):
    times = tmp_path / "times.txt"
    times.write_text("0\n1\n2\n")
    (tmp_path / name).write_bytes(content)
    read_or_refuse(tmp_path / name, times)


@settings(parent=relaxed, max_examples=60)
@given(content=st.one_of(text, st.binary(max_size=200)))
def test_any_times_file(tmp_path, content):
    (tmp_path / "00.txt").write_text("1 0 0 5 0 1 0 6 0 0 1 7\n" * 3)
    (tmp_path / "times.txt").write_bytes(content)
    read_or_refuse(tmp_path / "00.txt", tmp_path / "times.txt")


@settings(parent=relaxed, max_examples=60)
@given(
    content=st.recursive(
        st.one_of(st.none(), st.text(max_size=8), st.integers(), st.floats()),
        lambda inner: st.one_of(
            st.lists(inner, max_size=3),
            st.dictionaries(
                st.sampled_from(["sequences", "groundtruth", "runs", "methods", "units", "align", "frames", "x"]),
                inner,
                max_size=4,
            ),
        ),
        max_leaves=12,
    )
)
def test_any_study_file(tmp_path, content):
    import yaml

    (tmp_path / "study.yaml").write_text(yaml.safe_dump(content))
    said = ""
    try:
        load_study(str(tmp_path / "study.yaml"))
    except TrajectoryError as error:
        said = str(error)
    assert "\n" not in said


@pytest.fixture(scope="module", params=["drive.bag", "drive.mcap", "drive.db3"])
def recording(request, tmp_path_factory):
    """A recording of three poses, and its one file that is damaged."""
    folder = tmp_path_factory.mktemp("bags")
    ros1 = request.param.endswith(".bag")
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_JAZZY)
    if ros1:
        writer = Ros1Writer(folder / request.param)
    else:
        plugin = StoragePlugin.MCAP if request.param.endswith("mcap") else StoragePlugin.SQLITE3
        writer = Ros2Writer(folder / "drive", version=9, storage_plugin=plugin)
    kind = "geometry_msgs/msg/PoseStamped"
    types = store.types
    extra = {"seq": 0} if ros1 else {}
    with writer:
        link = writer.add_connection("/pose", kind, typestore=store)
        for stamp in range(3):
            header = types["std_msgs/msg/Header"](
                stamp=types["builtin_interfaces/msg/Time"](sec=stamp, nanosec=0), frame_id="map", **extra
            )
            pose = types["geometry_msgs/msg/Pose"](
                types["geometry_msgs/msg/Point"](1.0, 2.0, 3.0),
                types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
            )
            content = types[kind](header, pose)
            writer.write(link, stamp, (store.serialize_ros1 if ros1 else store.serialize_cdr)(content, kind))
    source = folder / (request.param if ros1 else "drive")
    file = source if ros1 else next(path for path in source.iterdir() if path.suffix in (".mcap", ".db3"))
    assert read_or_refuse(source)
    return source, file, file.read_bytes()


@settings(parent=relaxed, max_examples=60)
@given(data=st.data())
def test_any_damage_to_a_recording(recording, data):
    source, file, whole = recording
    damaged = bytearray(whole[: data.draw(st.integers(0, len(whole)))] if data.draw(st.booleans()) else whole)
    for _ in range(data.draw(st.integers(1, 6)) if damaged else 0):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    try:
        file.write_bytes(bytes(damaged))
        read_or_refuse(source)
    finally:
        file.write_bytes(whole)


@settings(parent=relaxed, max_examples=40)
@given(content=st.binary(max_size=400))
def test_any_bytes_as_a_recording(tmp_path, content):
    for name in ("a.bag", "a.mcap", "a.db3"):
        (tmp_path / name).write_bytes(content)
        assert not read_or_refuse(tmp_path / name)
