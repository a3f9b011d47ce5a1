from __future__ import annotations

import math

import numpy as np
import pytest

from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, ImuSamples, PointCloud, Sensor
from taskslam.robot import Imperfections, Robot, load_robot
from taskslam.simulation.motion import Motion
from taskslam.simulation.simulator import Simulator
from taskslam.world import World

SENSORS = {Sensor.IMU, Sensor.POINT_CLOUD, Sensor.WHEEL_ODOMETRY}


def changed(robot: Robot, **parts: dict[str, object]) -> Robot:
    rig = robot.rig
    update = {name: getattr(rig, name).model_copy(update=values) for name, values in parts.items()}
    return robot.model_copy(update={"rig": rig.model_copy(update=update)})


def noise_free(rate: float = 100.0) -> Robot:
    still = {"gyro_noise": 0.0, "accel_noise": 0.0, "rate": rate}
    robot = changed(load_robot("turtlebot2"), imu=still, lidar_3d={"noise": 0.0})
    return robot.model_copy(update={"imperfections": Imperfections()})


def weave(simulator: Simulator, seconds: float) -> list[object]:
    """Drive curves with changing speed."""
    out: list[object] = []
    end = simulator.now + round(seconds * NANOSECONDS)
    while simulator.now < end:
        t = simulator.now / NANOSECONDS
        simulator.drive(0.2 + 0.1 * math.sin(2 * t), 0.9 * math.cos(1.3 * t))
        out += simulator.advance(simulator.now + NANOSECONDS // 20)
    return out


@pytest.mark.parametrize("rate", [100.0, 200.0])
def test_integrating_the_noise_free_imu_gives_the_trajectory_back(rate: float, room: World) -> None:
    simulator = Simulator(room, noise_free(rate), 0, sensors=SENSORS)
    start = SE2(-2.0, -1.0, 0.3)
    simulator.reset(start)
    samples = [m for m in weave(simulator, 8.0) if isinstance(m, ImuSamples)]
    assert len(samples) == 8 * rate
    mount = load_robot("turtlebot2").rig.imu.mount.matrix()  # type: ignore[union-attr]
    lever = mount[:2, 3]
    dt, theta, velocity = 1.0 / rate, start.theta, np.zeros(2)
    place = np.array([start.x, start.y]) + rotation(theta) @ lever
    for sample in samples:
        turn = sample.angular_velocity[0, 2] * dt
        acceleration = rotation(theta + 0.5 * turn) @ sample.linear_acceleration[0, :2]
        place = place + velocity * dt + 0.5 * acceleration * dt**2
        velocity = velocity + acceleration * dt
        theta += turn
    base = place - rotation(theta) @ lever
    truth = simulator.true_pose()
    assert math.hypot(base[0] - truth.x, base[1] - truth.y) < 2e-3
    assert math.isclose(math.cos(theta - truth.theta), 1.0, abs_tol=1e-9)
    assert np.allclose([s.linear_acceleration[0, 2] for s in samples], 9.8)


def rotation(theta: float) -> np.ndarray:
    return np.array([[math.cos(theta), -math.sin(theta)], [math.sin(theta), math.cos(theta)]])


def test_imu_noise_has_the_stated_spread_and_a_bias_that_stays_for_the_run(room: World) -> None:
    wrong = Imperfections.model_validate({"imu": {"gyro_bias": 0.05, "accel_bias": 0.5}})
    robot = load_robot("turtlebot2").model_copy(update={"imperfections": wrong})
    simulator = Simulator(room, robot, 1, sensors=SENSORS)

    def at_rest() -> np.ndarray:
        simulator.reset(SE2())
        found = [m for m in simulator.advance(simulator.now + 20 * NANOSECONDS) if isinstance(m, ImuSamples)]
        return np.array([np.r_[m.angular_velocity[0], m.linear_acceleration[0]] for m in found])

    first, second = at_rest(), at_rest()
    assert np.allclose(first.std(axis=0), [0.00276] * 3 + [0.03924] * 3, rtol=0.1)
    assert np.allclose(first.mean(axis=0), second.mean(axis=0), atol=0.01)
    assert np.abs(first.mean(axis=0)[:3]).max() > 0.01
    assert not np.array_equal(first, second)


def test_a_cloud_lies_on_the_walls_with_ring_and_elevation(room: World) -> None:
    robot = changed(noise_free(), lidar_3d={"range_min": 0.1, "noise": 0.0})
    simulator = Simulator(room, robot, 0, sensors=SENSORS)
    cloud = next(m for m in simulator.advance(NANOSECONDS) if isinstance(m, PointCloud))
    mount = robot.rig.lidar_3d.mount.xyz  # type: ignore[union-attr]
    points = cloud.points.astype(float) + mount
    elevation = np.arctan2(cloud.points[:, 2], np.hypot(cloud.points[:, 0], cloud.points[:, 1]))
    assert np.allclose(elevation, np.linspace(-math.pi / 12, math.pi / 12, 16)[cloud.ring], atol=1e-5)
    on_wall = np.isclose(np.abs(points[:, 0]), 4.0, atol=1e-3) | np.isclose(np.abs(points[:, 1]), 3.0, atol=1e-3)
    on_floor = np.isclose(points[:, 2], 0.0, atol=1e-3)
    on_pillar = (np.abs(points[:, 0] - 2.0) < 0.101) & (np.abs(points[:, 1] - 1.0) < 0.101)
    assert (on_wall | on_floor | on_pillar).all()
    assert (cloud.time_offset == 0).all()


def test_a_rolling_cloud_is_seen_from_where_the_robot_was(room: World) -> None:
    robot = changed(noise_free(), lidar_3d={"rolling": True, "noise": 0.0, "range_min": 0.1})
    simulator = Simulator(room, robot, 0, sensors=SENSORS)
    simulator.reset(SE2(-2.0, 0.0, 0.0))
    cloud = [m for m in weave_straight(simulator, 3.0) if isinstance(m, PointCloud)][-1]
    ahead = np.abs(np.arctan2(cloud.points[:, 1], cloud.points[:, 0])) < 0.01
    level = np.abs(cloud.points[:, 2]) < 0.2
    chosen = ahead & level
    travelled_since = 0.4 * -cloud.time_offset[chosen] / NANOSECONDS
    wall = 4.0 - (simulator.true_pose().x - travelled_since) - 0.071
    assert chosen.sum() >= 2
    assert np.allclose(cloud.points[chosen, 0], wall, atol=2e-3)
    assert cloud.time_offset.min() < -0.09 * NANOSECONDS
    assert cloud.time_offset.max() == 0


def weave_straight(simulator: Simulator, seconds: float) -> list[object]:
    out: list[object] = []
    end = simulator.now + round(seconds * NANOSECONDS)
    while simulator.now < end:
        simulator.drive(0.4, 0.0)
        out += simulator.advance(simulator.now + NANOSECONDS // 20)
    return out


def test_sensors_that_nobody_asks_for_are_not_simulated(room: World) -> None:
    simulator = Simulator(room, load_robot("turtlebot2"), 0, sensors={Sensor.WHEEL_ODOMETRY})
    assert {m.sensor for m in simulator.advance(NANOSECONDS)} == {Sensor.WHEEL_ODOMETRY}


def test_motion_between_steps_lies_on_the_arc() -> None:
    motion = Motion(0, SE2())
    radius, step = 0.5, 0.05
    for index in range(1, 10):
        angle = index * step
        motion.push(index * 1000, radius * math.sin(angle), radius * (1 - math.cos(angle)), angle, 0.1, 0.2)
    x, y, theta = motion.pose_at([4500])[0]
    assert theta == pytest.approx(4.5 * step)
    assert math.hypot(x, y - radius) == pytest.approx(radius, abs=1e-6)
    assert motion.pose_at([99_999_999])[0] == pytest.approx(motion.pose_at([9000])[0])
