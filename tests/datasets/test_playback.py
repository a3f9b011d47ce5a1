"""A pass over a recording gives what feeding the same measurements by hand gives, bit for bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from taskslam.benchmark.playback import check_sensors, find_beginning, play
from taskslam.datasets.opening import open_dataset
from taskslam.measurements import NANOSECONDS
from taskslam.record import RunWriter
from taskslam.record.trajectories import read_spatial_trajectory
from taskslam.slam import Status
from taskslam.slam.cards import card_of
from taskslam.slam.guest.host import MethodHost


@pytest.mark.parametrize("bag", ["mcap"], indirect=True)  # each container gives back the same measurements
@pytest.mark.parametrize(("method", "package"), [("karto", "numpy"), ("kiss_icp", "kiss_icp"), ("rko_lio", "rko_lio")])
def test_replayed_and_fed_poses_are_the_same(bag, recorded, tmp_path, method, package):
    pytest.importorskip(package)
    with MethodHost(method, {}, recorded.robot.rig, tmp_path / "fed.log") as host:
        for measurement in recorded.measurements:
            host.feed(measurement)
        fed = [e for e in host.collect(3 * NANOSECONDS) if e.status is Status.TRACKING]
    record = RunWriter(tmp_path / "run")
    with open_dataset(bag) as dataset, MethodHost(method, {}, dataset.rig, record.method_log) as host:
        check_sensors(dataset, card_of(method))
        beginning = find_beginning(dataset, host.card)
        played = play(dataset, beginning, host, record, 0, 0, lambda stamp: stamp, lambda now: None)
    assert played.poses == len(fed) > 5
    assert played.end == recorded.measurements[-1].stamp
    T_map_start = beginning.T_map_start
    with record:
        pass
    path = Path(record.folder) / "round00" / "estimate.tum"
    replayed = read_spatial_trajectory(path)
    assert replayed.stamps.tolist() == [estimate.stamp for estimate in fed]
    expected = np.array([(T_map_start @ estimate.T_start_base)[:3, 3] for estimate in fed])
    assert np.array_equal(replayed.positions, expected)


@pytest.mark.parametrize("bag", ["mcap"], indirect=True)
def test_the_start_lies_on_the_truth_at_the_first_frame(bag, recorded):
    with open_dataset(bag) as dataset:
        beginning = find_beginning(dataset, card_of("kiss_icp"))
    assert beginning.stamp == NANOSECONDS // 10
    pose = dict(recorded.truth)[beginning.stamp]
    assert np.array_equal(beginning.T_map_start, pose.matrix())
