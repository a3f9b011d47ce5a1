"""Frames are drawn when somebody looks, once, and only if somebody does; what is drawn depends on nothing of this."""

from __future__ import annotations

import pytest

from taskslam.geometry import SE2
from taskslam.measurements import Measurement
from taskslam.robot import load_robot
from taskslam.simulation.motion import Motion
from taskslam.simulation.sensors.camera import StereoCameraSensor
from taskslam.simulation.sensors.later import WhileStanding
from taskslam.simulation.sensors.rgbd import RgbdCameraSensor
from taskslam.slam.guest.latency import Schedule
from taskslam.world.loading import load_world

SMALL = {"width": 64, "height": 48}
PERIOD = 33_000_000
HERE, THERE = SE2(0.5, 0.2, 0.3), SE2(0.6, 0.2, 0.3)


def sensor(kind: str, exposure: str | float) -> StereoCameraSensor | RgbdCameraSensor:
    name = {"stereo": "turtlebot2", "rgbd": "turtlebot2_d435i"}[kind]
    camera = getattr(load_robot(name).rig, kind).model_copy(update=SMALL | {"exposure": exposure})
    return (StereoCameraSensor if kind == "stereo" else RgbdCameraSensor)(camera, load_world("house"), seed=4)


def pixels(frame: Measurement) -> bytes:
    fields = ("left", "right") if hasattr(frame, "left") else ("image", "depth")
    return b"".join(getattr(frame, name).tobytes() for name in fields)


def count_drawings(device: StereoCameraSensor | RgbdCameraSensor, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    drawn = [0]
    draw = device._scene.view

    def counted(*arguments, **more):  # type: ignore[no-untyped-def]
        drawn[0] += 1
        return draw(*arguments, **more)

    monkeypatch.setattr(device._scene, "view", counted)
    return drawn


@pytest.mark.parametrize(("kind", "eyes"), [("stereo", 2), ("rgbd", 1)])
def test_a_dropped_frame_is_not_drawn_and_changes_no_other(kind: str, eyes: int, monkeypatch) -> None:
    device, watched = sensor(kind, 1.5), sensor(kind, 1.5)
    drawn = count_drawings(device, monkeypatch)
    frames = [device.measure(k * PERIOD, Motion(0, SE2(0.1 * k, 0.0, 0.2))) for k in range(9)]
    looked_at = [pixels(watched.measure(k * PERIOD, Motion(0, SE2(0.1 * k, 0.0, 0.2)))) for k in range(9)]
    assert drawn == [0]
    schedule = Schedule((device.sensor,), queue=1, latency=4 * PERIOD)  # takes one frame of four
    taken = [hand_over.measurement for frame in frames for hand_over in schedule.offer(frame)]
    assert 0 < len(taken) < len(frames)
    for frame in taken:
        assert pixels(frame) == looked_at[frame.stamp // PERIOD]
        pixels(frame)  # a second look draws nothing
    assert drawn == [eyes * len(taken)]


@pytest.mark.parametrize("kind", ["stereo", "rgbd"])
def test_automatic_exposure_looks_at_every_frame(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    device = sensor(kind, "auto")
    drawn = count_drawings(device, monkeypatch)
    device.measure(0, Motion(0, HERE))
    assert drawn[0] > 0


@pytest.mark.parametrize(("kind", "eyes"), [("stereo", 2), ("rgbd", 1)])
@pytest.mark.parametrize("exposure", ["auto", 1.5])
def test_a_robot_that_stands_sees_the_same_with_fresh_noise(
    kind: str, eyes: int, exposure: str | float, monkeypatch: pytest.MonkeyPatch
) -> None:
    standing, moved = sensor(kind, exposure), sensor(kind, exposure)
    drawn = count_drawings(standing, monkeypatch)
    motions = [Motion(0, HERE)] * 3 + [Motion(0, THERE)]
    frames = [pixels(standing.measure(k * PERIOD, motion)) for k, motion in enumerate(motions)]
    assert drawn == [2 * eyes]
    assert len(set(frames)) == 4
    afresh = []
    for k, motion in enumerate(motions):  # as if the robot had never stood still
        moved._standing = WhileStanding()
        afresh.append(pixels(moved.measure(k * PERIOD, motion)))
    assert frames == afresh
