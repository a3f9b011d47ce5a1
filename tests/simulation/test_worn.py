"""What is wrong with a worn robot, each by its statistics; and a perfect robot knows nothing of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError
from scipy import stats

from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, ImuSamples, LaserScan, Measurement, Sensor, WheelOdometry
from taskslam.robot import Imperfections, Robot, load_robot
from taskslam.robot.imperfections import CarpetImperfections, Fitting, LidarImperfections, MotorImperfections
from taskslam.simulation.carpets import Carpets
from taskslam.simulation.fitting import LateClock, truly_mounted
from taskslam.simulation.motion import Motion
from taskslam.simulation.motors import Motors
from taskslam.simulation.sensors.camera import StereoCameraSensor
from taskslam.simulation.sensors.exposure import AutomaticExposure
from taskslam.simulation.sensors.faint_rays import FaintRays
from taskslam.simulation.sensors.raytracing import RayCaster
from taskslam.simulation.sensors.shutter import Shutter
from taskslam.simulation.sensors.wheel_odometry import WheelOdometer
from taskslam.simulation.simulator import Simulator
from taskslam.world import Material, World

SEEDS = range(300)


def robot_with(**wrong: dict[str, float]) -> Robot:
    """The published robot without noise, and wrong in this alone."""
    robot = load_robot("turtlebot2")
    still = {"odometry": {"gyro_noise": 0.0}, "lidar_2d": {"noise": 0.0, "resolution": 0.0}, "imu": {"gyro_noise": 0.0}}
    parts = {name: getattr(robot.rig, name).model_copy(update=update) for name, update in still.items()}
    rig = robot.rig.model_copy(update=parts)
    return robot.model_copy(update={"rig": rig, "imperfections": Imperfections.model_validate(wrong)})


def driven(simulator: Simulator, seconds: float, linear: float, angular: float) -> list[Measurement]:
    out: list[Measurement] = []
    end = simulator.now + round(seconds * NANOSECONDS)
    while simulator.now < end:
        simulator.drive(linear, angular)
        out += simulator.advance(min(end, simulator.now + NANOSECONDS // 20))
    return out


def evenly_spread(values: object, low: float, high: float) -> bool:
    return bool(stats.kstest(values, stats.uniform(low, high - low).cdf).pvalue > 0.001)


def normally_spread(values: object, spread: float) -> bool:
    return bool(stats.kstest(values, stats.norm(0.0, spread).cdf).pvalue > 0.001)


def test_nothing_new_is_wrong_with_the_published_robots_nor_written_in_their_files() -> None:
    written = load_robot("turtlebot2").model_dump(mode="json")
    assert list(written["imperfections"]) == ["odometry", "imu", "others"]
    assert list(written["imperfections"]["odometry"]) == ["gyro_bias", "scale", "slip"]
    assert list(written["imperfections"]["imu"]) == ["gyro_bias", "accel_bias"]
    assert "readout" not in written["rig"]["stereo"]


def test_the_worn_robot_is_written_and_read_back_whole() -> None:
    worn = load_robot("turtlebot2_worn")
    assert Robot.model_validate(worn.model_dump(mode="json")) == worn
    assert worn.rig.lidar_2d is not None
    assert worn.rig.stereo is not None
    assert (worn.rig.lidar_2d.rolling, worn.rig.stereo.readout) == (True, 0.02)
    published = load_robot("turtlebot2")
    for name, part in worn.rig.parts().items():
        assert getattr(part, "mount", None) == getattr(getattr(published.rig, name), "mount", None)


def test_a_sensor_sits_within_what_a_person_measures_and_keeps_its_place_through_a_run() -> None:
    sheet = load_robot("turtlebot2").rig.lidar_2d
    assert sheet is not None
    wrong = Fitting(misplaced=0.005, misaligned=math.radians(0.5))
    mounts = [truly_mounted(sheet, wrong, seed, "lidar_2d").mount for seed in SEEDS]
    moved = np.array([mount.xyz for mount in mounts]) - sheet.mount.xyz
    turned = np.array([mount.rpy for mount in mounts]) - sheet.mount.rpy
    for axis in range(3):
        assert evenly_spread(moved[:, axis], -0.005, 0.005)
        assert evenly_spread(turned[:, axis], -math.radians(0.5), math.radians(0.5))
    assert np.abs(np.corrcoef(np.hstack([moved, turned]).T) - np.eye(6)).max() < 0.25
    assert truly_mounted(sheet, wrong, 7, "lidar_2d").mount == mounts[7]
    assert truly_mounted(sheet, wrong, 7, "lidar_3d").mount != mounts[7]
    assert truly_mounted(sheet, Fitting(), 7, "lidar_2d") is sheet


def test_what_a_misaligned_lidar_sees_is_turned(room: World) -> None:
    robot = robot_with(lidar_2d={"misplaced": 0.05, "misaligned": 0.1})
    simulator = Simulator(room, robot, 3)
    assert robot.rig.lidar_2d is not None
    true = truly_mounted(robot.rig.lidar_2d, robot.imperfections.fitting("lidar_2d"), 3, "lidar_2d").mount
    for _ in range(2):  # after every reset alike
        simulator.reset(SE2())
        scan = next(m for m in driven(simulator, 0.2, 0.0, 0.0) if isinstance(m, LaserScan))
        angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        beam = true.matrix()[:3, :3] @ np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
        ahead = np.abs(angles) < 0.3  # the wall at x = 4
        assert np.allclose(scan.ranges[ahead], (4.0 - true.xyz[0]) / beam[0, ahead], atol=1e-3)


def test_stamps_are_late_by_an_offset_of_the_run_and_a_jitter(room: World) -> None:
    late, jitter, period = 0.02, 0.03, 0.1
    exact, told = (
        Simulator(room, robot_with(**wrong), 5, sensors={Sensor.LASER_SCAN, Sensor.WHEEL_ODOMETRY})
        for wrong in ({}, {"lidar_2d": {"late": late, "jitter": jitter}})
    )
    runs = [driven(simulator, 20.0, 0.1, 0.4) for simulator in (exact, told)]
    assert [m.stamp for m in runs[1]] == sorted(m.stamp for m in runs[1])
    true, seen = ([m for m in run if isinstance(m, LaserScan)] for run in runs)
    for one, other in zip(true, seen, strict=False):  # the same scan under another stamp
        assert np.array_equal(one.ranges, other.ranges)
    delays = np.array([(b.stamp - a.stamp) / NANOSECONDS for a, b in zip(true, seen, strict=False)])
    offset = LateClock(Fitting(late=late), 5, "lidar_2d").next() / NANOSECONDS
    assert 0.0 < offset < late < period
    assert evenly_spread(delays, offset, offset + jitter)
    offsets = [LateClock(Fitting(late=late), seed, "lidar_2d").next() / NANOSECONDS for seed in SEEDS]
    assert evenly_spread(offsets, 0.0, late)


def test_stamps_that_could_change_places_are_refused() -> None:
    robot = robot_with().model_dump()
    robot["imperfections"]["lidar_2d"] = {"jitter": 0.1}
    with pytest.raises(ValidationError, match=r"lidar_2d\.jitter: 0\.1 s; expected less than a period, 0\.1 s"):
        Robot.model_validate(robot)


def heading_rates(odometer: WheelOdometer, seconds: int, resets: int) -> np.ndarray:
    """(resets, seconds) what a gyro says at rest after each reset, averaged over each second, rad/s."""
    found = np.empty((resets, seconds))
    for k in range(resets):
        odometer.reset(k)
        before = 0.0
        for second in range(seconds):
            for _ in range(10):
                odometer.integrate(0.0, 0.0, 0.1)
            theta = odometer.measure(0, Motion(0, SE2())).T_odom_base.theta
            found[k, second], before = theta - before, theta
    return found


def odometer(**wrong: float) -> WheelOdometer:
    robot = robot_with(odometry=wrong)
    return WheelOdometer(robot.rig.odometry, robot.imperfections.odometry, 4)


def test_a_gyro_s_bias_is_drawn_anew_at_each_reset_and_walks() -> None:
    turned_on = heading_rates(odometer(gyro_turn_on=0.01), 2, 300)
    assert normally_spread(turned_on[:, 0], 0.01)
    assert np.allclose(turned_on[:, 1], turned_on[:, 0])  # it stays until the next
    walks = heading_rates(odometer(gyro_walk=0.01), 17, 300)
    steps = walks[:, 16] - walks[:, 0]
    assert normally_spread(steps, 0.01 * math.sqrt(16.0 - 1.0 / 3.0))  # of means over a second each
    assert abs(np.corrcoef(walks[1:, 16], walks[:-1, 16])[0, 1]) < 0.2


def test_the_imu_s_gyro_walks_too(room: World) -> None:
    simulator = Simulator(room, robot_with(imu={"gyro_turn_on": 0.01, "gyro_walk": 0.002}), 2, sensors={Sensor.IMU})
    first, last = [], []
    for _ in range(60):
        simulator.reset(SE2())
        samples = [m for m in driven(simulator, 0.5, 0.0, 0.0) if isinstance(m, ImuSamples)]
        first.append(samples[0].angular_velocity[0])
        last.append(samples[-1].angular_velocity[0])
    assert normally_spread(np.ravel(first), math.hypot(0.01, 0.002 * 0.1))
    assert normally_spread(np.ravel(last) - np.ravel(first), 0.002 * math.sqrt(0.49))


def test_scale_and_slip_are_drawn_for_each_round() -> None:
    def ways(times: int, **wrong: float) -> np.ndarray:
        wheels, out = odometer(**wrong), []
        for k in range(300):
            wheels.reset(k)
            for _ in range(times):
                wheels.integrate(0.01, 0.0, 0.01)
            out.append(wheels.measure(0, Motion(0, SE2())).T_odom_base.x / (0.01 * times) - 1.0)
        return np.array(out)

    assert normally_spread(ways(1, scale=-0.01, scale_of_round=0.02) + 0.01, 0.02)
    slips = ways(100, slip=0.01, slip_of_round=0.05)  # of one metre
    sizes = np.abs(np.random.default_rng(0).standard_normal(100_000))
    expected = (0.01 + 0.05 * sizes) * np.random.default_rng(1).standard_normal(100_000)
    assert stats.ks_2samp(slips, expected).pvalue > 0.001


def test_carpets_lie_on_their_share_of_the_floor_and_push_each_its_own_way() -> None:
    carpets = Carpets(CarpetImperfections(size=1.5, share=0.3, scale=0.02, drift=0.01), 1)
    cells = [(1.5 * column + 0.7, 1.5 * row + 0.7) for column in range(-20, 20) for row in range(-20, 20)]
    effects = np.array([(*carpets.driven_over(-0.2, x, y), x, y) for x, y in cells])
    lying = effects[effects[:, 0] != -0.2]
    assert stats.binomtest(len(lying), len(cells), 0.3).pvalue > 0.001
    assert np.allclose(lying[:, 0], -0.2 * 1.02)
    push = lying[:, 1:3] - lying[:, 3:]
    assert np.allclose(np.hypot(*push.T), 0.002)
    assert evenly_spread(np.arctan2(push[:, 1], push[:, 0]), -math.pi, math.pi)
    assert carpets.driven_over(0.1, 0.1, 0.1) == carpets.driven_over(0.1, 0.1, 0.1)


def test_a_carpet_s_push_is_in_the_truth_and_in_no_sensor_of_the_robot(room: World) -> None:
    pushed, bare = (
        Simulator(room, robot_with(**wrong), 2)
        for wrong in ({"carpets": {"size": 50.0, "share": 1.0, "drift": 0.05, "scale": 0.1}}, {})
    )
    ways = []
    for simulator in (pushed, bare):
        odometry = [m for m in driven(simulator, 5.0, 0.2, 0.0) if isinstance(m, WheelOdometry)][-1]
        ways.append((odometry.T_odom_base.x, simulator.true_pose()))
    (counted, true), (plain, straight) = ways
    assert math.isclose(counted, 1.1 * plain, rel_tol=1e-6)
    assert math.isclose(math.hypot(true.x - straight.x, true.y - straight.y), 0.05 * straight.x, rel_tol=0.01)


def test_motors_follow_with_a_lag_and_a_wheel_that_should_crawl_stands() -> None:
    motors = Motors(MotorImperfections(lag=0.1, deadband=0.02, track=0.2))
    answers = [motors.driven(0.3, 0.0, 0.005)[0] for _ in range(400)]
    assert math.isclose(answers[19], 0.3 * (1.0 - math.exp(-1.0)), rel_tol=1e-9)  # after 0.1 s
    assert math.isclose(answers[-1], 0.3, rel_tol=1e-6)
    stopping = [motors.driven(0.0, 0.0, 0.005)[0] for _ in range(400)]
    assert stopping[-1] == 0.0
    assert min(speed for speed in stopping if speed) >= 0.02
    still = Motors(MotorImperfections(deadband=0.02, track=0.2))
    assert still.driven(0.019, 0.0, 0.005) == (0.0, 0.0)
    assert still.driven(0.0, 0.19, 0.005) == (0.0, 0.0)
    assert still.driven(0.02, 0.1, 0.005) == pytest.approx((0.015, 0.15))  # left 0.01 stands, right 0.03 turns
    assert Motors(None).driven(0.001, 0.002, 0.005) == (0.001, 0.002)


def test_a_dark_wall_is_seen_as_far_as_its_reflectance_and_the_angle_allow(make_world: Callable[..., World]) -> None:
    wall = make_world([(3.0, -20.0, 0.0, 3.2, 20.0, 2.0)])
    gray = 0.5  # sRGB
    dark = replace(wall, materials=tuple(replace(look, diffuse=(gray, gray, gray, 1.0)) for look in wall.materials))
    rays = FaintRays(dark, dark.visual, RayCaster(dark.visual), LidarImperfections(reach_dark=3.0))
    angles = np.linspace(-1.3, 1.3, 501)
    directions = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1).astype(np.float32)
    origins = np.tile(np.array([0.0, 0.0, 1.0], np.float32), (len(angles), 1))
    true = 3.0 / np.cos(angles)
    reflects = ((gray + 0.055) / 1.055) ** 2.4
    seen = true < 3.0 * np.sqrt(reflects * np.cos(angles) / 0.1)
    assert 50 < seen.sum() < 450
    measured = rays.distances(origins, directions)
    assert np.array_equal(np.isfinite(measured), seen)
    assert np.allclose(measured[seen], true[seen], rtol=1e-5)


def test_glass_is_seen_about_its_normal_only_and_what_is_behind_it_else(make_world: Callable[..., World]) -> None:
    pane, wall = (2.0, -20.0, 0.0, 2.01, 20.0, 2.0), (5.0, -40.0, 0.0, 5.2, 40.0, 2.0)
    world = make_world([pane, wall])
    first = world.visual.triangles[:, 0] < 8  # the corners of the first box
    visual = replace(world.visual, material=np.where(first, 1, 0).astype(np.int32))
    looks = (Material("plaster"), Material("clear", diffuse=(0.9, 0.9, 0.9, 0.3)))
    world = replace(world, visual=visual, materials=looks)
    rays = FaintRays(world, visual, RayCaster(visual), LidarImperfections(glass_angle=0.071))
    angles = np.linspace(-1.0, 1.0, 401)
    directions = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1).astype(np.float32)
    origins = np.tile(np.array([0.0, 0.0, 1.0], np.float32), (len(angles), 1))
    expected = np.where(np.abs(angles) < 0.071, 2.0, 5.0) / np.cos(angles)
    assert np.allclose(rays.distances(origins, directions), expected, rtol=1e-5)
    named = replace(world, materials=(looks[0], Material("Shop window 3")))
    assert (
        FaintRays(named, visual, RayCaster(visual), LidarImperfections(glass_angle=0.071))._glass.sum() == first.sum()
    )


def test_a_worn_exposure_follows_the_light_with_its_time_constant() -> None:
    light = [np.full((8, 8), level, np.float32) for level in (0.4, 0.1)]
    gains = []
    exposure = AutomaticExposure(30.0, 1.0)
    before = exposure.gain(light[0])
    gains = [exposure.gain(light[1]) for _ in range(30)]
    target = AutomaticExposure(30.0).gain(light[1])
    assert math.isclose(math.log(gains[-1] / before) / math.log(target / before), 1.0 - math.exp(-1.0), rel_tol=1e-6)


def test_rows_of_a_rolling_shutter_are_seen_from_where_the_robot_was(room: World) -> None:
    camera = load_robot("turtlebot2").rig.stereo
    assert camera is not None
    small = {"width": 96, "height": 64, "noise": 0.0, "exposure": 1.0}
    rolling = camera.model_copy(update=small | {"readout": 0.02})
    motion = Motion(0, SE2(-1.0, 0.2, 0.1))
    for k in range(1, 11):
        motion.push(k * 5_000_000, -1.0 + 0.0015 * k, 0.2, 0.1 + 0.005 * k, 0.3, 1.0)
    stamp = 50_000_000
    poses = Shutter(rolling).poses(stamp, motion)
    assert len(poses) == math.ceil(rolling.focal_length * (0.006 / 0.7 + 0.02) / 0.5)
    picture = StereoCameraSensor(rolling, room, 0).measure(stamp, motion).left
    at_once = StereoCameraSensor(camera.model_copy(update=small), room, 0)
    edges = np.linspace(0, 64, len(poses) + 1).astype(int)
    for pose, begin, end in zip(poses, edges[:-1], edges[1:], strict=True):
        middle = stamp - round((1.0 - (begin + end) / 128.0) * 20_000_000)
        assert math.isclose(pose[2], motion.pose_at([middle])[0, 2], abs_tol=0.0006)
        whole = at_once.measure(stamp, Motion(stamp, SE2(*pose.tolist()))).left
        assert np.array_equal(picture[begin:end], whole[begin:end])
    assert not np.array_equal(picture, at_once.measure(stamp, motion).left)
    standing = Motion(0, SE2(-1.0, 0.2, 0.1))
    still = StereoCameraSensor(rolling, room, 0).measure(stamp, standing).left
    assert np.array_equal(still, at_once.measure(stamp, standing).left)


def test_the_whole_worn_robot_repeats_itself_byte_for_byte(room: World) -> None:
    def trace(seed: int, first: float) -> list[bytes]:
        sensors = {Sensor.LASER_SCAN, Sensor.WHEEL_ODOMETRY, Sensor.IMU, Sensor.POINT_CLOUD}
        simulator = Simulator(room, load_robot("turtlebot2_worn"), seed, sensors=sensors)
        driven(simulator, first, 0.2, 0.3)
        simulator.go_on(10 * NANOSECONDS, 3)  # what came before leaves the next round alone
        simulator.reset(SE2())
        run = driven(simulator, 0.5, 0.3, 0.5)
        return [repr((m.stamp, getattr(m, "ranges", getattr(m, "T_odom_base", None)))).encode() for m in run]

    assert trace(3, 0.1) == trace(3, 0.4)
    assert trace(3, 0.1) != trace(4, 0.1)
