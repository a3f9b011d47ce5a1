from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from taskslam.errors import ScenarioError
from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS, LaserScan, WheelOdometry
from taskslam.robot import Imperfections, Robot, load_robot
from taskslam.simulation.simulator import Simulator
from taskslam.world import World


def quiet(robot: Robot) -> Robot:
    """The same robot without any noise."""
    rig = robot.rig
    odometry = rig.odometry.model_copy(update={"gyro_noise": 0})
    lidar = rig.lidar_2d.model_copy(update={"noise": 0.0, "resolution": 0.0}) if rig.lidar_2d else None
    rig = rig.model_copy(update={"odometry": odometry, "lidar_2d": lidar})
    return robot.model_copy(update={"rig": rig, "imperfections": Imperfections()})


def drive_a_while(
    simulator: Simulator, seconds: float, linear: float, angular: float
) -> list[WheelOdometry | LaserScan]:
    out: list[WheelOdometry | LaserScan] = []
    end = simulator.now + round(seconds * NANOSECONDS)
    while simulator.now < end:
        simulator.drive(linear, angular)
        out += simulator.advance(min(end, simulator.now + NANOSECONDS // 20))
    return out


def test_measurements_come_in_stamp_order_at_their_rates(room: World) -> None:
    simulator = Simulator(room, load_robot("turtlebot2"), seed=1)
    measurements = drive_a_while(simulator, 2.0, 0.2, 0.3)
    stamps = [m.stamp for m in measurements]
    assert stamps == sorted(stamps)
    assert sum(isinstance(m, LaserScan) for m in measurements) == 20
    assert sum(isinstance(m, WheelOdometry) for m in measurements) == 100


def test_the_same_seed_gives_the_same_bytes_and_another_does_not(room: World) -> None:
    def trace(seed: int) -> bytes:
        simulator = Simulator(room, load_robot("turtlebot2"), seed)
        scans = [m.ranges.tobytes() for m in drive_a_while(simulator, 1.0, 0.3, 0.5) if isinstance(m, LaserScan)]
        return b"".join(scans) + repr(simulator.true_pose()).encode()

    assert trace(3) == trace(3)
    assert trace(3) != trace(4)


def test_a_round_cut_short_leaves_the_noise_of_the_next_one_alone(room: World) -> None:
    def second_round(first_seconds: float) -> list[bytes]:
        simulator = Simulator(room, load_robot("turtlebot2"), seed=5)
        drive_a_while(simulator, first_seconds, 0.1, 0.0)
        simulator.reset(SE2())
        return [m.ranges.tobytes() for m in drive_a_while(simulator, 0.5, 0.0, 0.0) if isinstance(m, LaserScan)]

    assert second_round(0.3) == second_round(1.0)


def test_noise_free_odometry_is_the_true_motion(room: World) -> None:
    simulator = Simulator(room, quiet(load_robot("turtlebot2")), seed=0)
    simulator.reset(SE2(-1.0, 0.5, 0.4))
    last = [m for m in drive_a_while(simulator, 6.0, 0.25, 0.6) if isinstance(m, WheelOdometry)][-1]
    truth = simulator.true_pose()
    there = SE2(-1.0, 0.5, 0.4) @ last.T_odom_base
    assert truth.distance_to(there) < 1e-5
    assert math.cos(truth.theta - there.theta) == pytest.approx(1.0)


def test_odometry_drifts_with_gyro_bias_and_wheel_scale(room: World) -> None:
    robot = quiet(load_robot("turtlebot2"))
    short = Imperfections.model_validate({"odometry": {"scale": -0.01}})
    robot = robot.model_copy(update={"imperfections": short})
    simulator = Simulator(room, robot, seed=0)
    last = [m for m in drive_a_while(simulator, 5.0, 0.2, 0.0) if isinstance(m, WheelOdometry)][-1]
    assert last.T_odom_base.x == pytest.approx(0.99 * simulator.true_pose().x)


def test_acceleration_is_limited_and_commands_lapse(room: World) -> None:
    robot = quiet(load_robot("turtlebot2"))
    simulator = Simulator(room, robot, seed=0)
    simulator.drive(0.3, 0.0)
    list(simulator.advance(NANOSECONDS // 4))
    speed = 0.6 * 0.25
    assert simulator.true_pose().x == pytest.approx(0.5 * speed * 0.25, rel=0.1)
    list(simulator.advance(3 * NANOSECONDS))
    rest = simulator.true_pose()
    list(simulator.advance(4 * NANOSECONDS))
    assert simulator.true_pose() == rest


def test_a_scan_measures_the_distance_to_the_walls(room: World) -> None:
    simulator = Simulator(room, quiet(load_robot("turtlebot2")), seed=0)
    scan = next(m for m in simulator.advance(NANOSECONDS) if isinstance(m, LaserScan))
    angles = scan.angles()
    ahead, left = np.argmin(abs(angles)), np.argmin(abs(angles - math.pi / 2))
    assert scan.ranges[ahead] == pytest.approx((4.0 - 0.04) / math.cos(angles[ahead]), abs=1e-4)
    assert scan.ranges[left] == pytest.approx(3.0 / math.sin(angles[left]), abs=1e-4)


def test_range_noise_has_the_stated_spread_and_rays_out_of_range_are_infinite(
    make_world: Callable[..., World],
) -> None:
    wall = make_world([(3.0, -50.0, 0.0, 3.1, 50.0, 1.0)])
    simulator = Simulator(wall, load_robot("turtlebot2"), seed=0)
    scans = np.array([m.ranges for m in simulator.advance(20 * NANOSECONDS) if isinstance(m, LaserScan)])
    middle = scans[:, scans.shape[1] // 2]
    assert np.std(middle) == pytest.approx(math.hypot(0.01, 0.01 / math.sqrt(12)), rel=0.15)
    assert np.isinf(scans[:, 0]).all()


def test_a_rolling_scan_sees_each_ray_from_where_the_robot_was(room: World) -> None:
    robot = quiet(load_robot("turtlebot2"))
    lidar = robot.rig.lidar_2d.model_copy(update={"rolling": True}) if robot.rig.lidar_2d else None
    robot = robot.model_copy(update={"rig": robot.rig.model_copy(update={"lidar_2d": lidar})})
    simulator = Simulator(room, robot, seed=0)
    scan = [m for m in drive_a_while(simulator, 1.6, 0.4, 0.0) if isinstance(m, LaserScan)][-1]
    middle = len(scan.ranges) // 2
    age = (len(scan.ranges) - 1 - middle) * scan.time_increment / NANOSECONDS
    expected = 4.0 - 0.04 - (simulator.true_pose().x - 0.4 * age)
    assert scan.ranges[middle] == pytest.approx(expected, abs=2e-3)
    assert scan.time_increment == round(0.1 * NANOSECONDS / 1024)


def test_the_bumper_holds_the_robot_at_the_wall(room: World) -> None:
    robot = quiet(load_robot("turtlebot2"))
    simulator = Simulator(room, robot, seed=0)
    simulator.reset(SE2(3.5, -2.0, 0.0))
    drive_a_while(simulator, 5.0, 0.3, 0.0)
    assert simulator.bumped()
    assert 4.0 - simulator.true_pose().x == pytest.approx(robot.footprint.radius, abs=0.01)
    assert simulator.touches(SE2(3.9, -2.0))
    assert not simulator.touches(SE2(3.7, -2.0))


def test_only_what_stands_between_clearance_and_height_is_bumped_into(make_world: Callable[..., World]) -> None:
    robot = load_robot("turtlebot2")
    sill_and_shelf = make_world([(1.0, -1.0, 0.0, 1.2, 1.0, 0.01), (1.0, -1.0, 0.5, 1.2, 1.0, 0.6)])
    table_leg = make_world([(1.0, -0.02, 0.0, 1.04, 0.02, 0.7)])
    assert not Simulator(sill_and_shelf, robot, 0).touches(SE2(1.1, 0.0))
    assert Simulator(table_leg, robot, 0).touches(SE2(1.1, 0.1))
    assert not Simulator(table_leg, robot, 0).touches(SE2(1.25, 0.0))


def test_lidar_can_look_at_collision_geometry_instead(make_world: Callable[..., World]) -> None:
    visual = make_world([(2.0, -5.0, 0.0, 2.1, 5.0, 1.0)])
    collision = make_world([(3.0, -5.0, 0.0, 3.1, 5.0, 1.0)])
    world = World("two", visual.visual, collision.collision, visual.materials, visual.models)
    for geometry, distance in (("visual", 2.0), ("collision", 3.0)):
        simulator = Simulator(world, quiet(load_robot("turtlebot2")), 0, geometry)
        scan = next(m for m in simulator.advance(NANOSECONDS) if isinstance(m, LaserScan))
        assert scan.ranges[512] == pytest.approx(distance - 0.04, abs=1e-3)


def test_a_sensor_rate_off_the_physics_grid_is_refused(room: World) -> None:
    robot = load_robot("turtlebot2")
    odometry = robot.rig.odometry.model_copy(update={"rate": 30.0})
    robot = robot.model_copy(update={"rig": robot.rig.model_copy(update={"odometry": odometry})})
    with pytest.raises(ScenarioError, match=r"odometry\.rate is 30 Hz"):
        Simulator(room, robot, 0)
