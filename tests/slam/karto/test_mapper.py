"""The whole method on recorded drives, and what its map does."""

import numpy as np
import pytest

from taskslam.slam.methods.karto import Karto

STANDING = 9  # scans that join the first keyframe before the robot moves


@pytest.fixture
def karto():
    def make(robot, **options) -> Karto:
        method = Karto(**options)
        method.start(robot.rig)
        return method

    return make


@pytest.fixture(scope="module")
def two_rounds(drives):
    """Twice round a small hall with a pillar in it, about 2 x 28 m."""
    walls = np.array(drives.box(0, 0, 9, 7) + drives.box(3, 3, 6, 4) + drives.box(0, 5.2, 0.5, 5.9))
    tour = np.array([(1.5, 1.5), (7.5, 1.5), (7.5, 5.5), (1.5, 5.5), (1.5, 1.5)])
    return drives.drive(walls, tour, rounds=2, speed=0.5)


def test_a_loop_of_66_metres_is_followed_to_two_centimetres(karto, loop_drive, follow) -> None:
    method = karto(loop_drive.robot)
    done = follow(method, loop_drive)
    assert done.errors.mean() < 0.015
    assert done.errors.max() < 0.03
    assert np.degrees(done.headings.max()) < 0.2
    assert set(done.statuses) == {"tracking"}


def test_a_loop_is_closed_under_odometry_ten_times_as_bad(karto, drives, follow) -> None:
    drive = drives.drive(drives.rooms(), drives.ROOMS_TOUR, bias=0.003, scale=0.03, speed=0.5)
    method = karto(drive.robot)
    done = follow(method, drive)
    assert method.map_summary().loops_closed >= 1
    assert done.errors[-1] < 0.01
    assert done.errors.mean() < 0.02


def test_closing_a_loop_pulls_the_live_pose_back(karto, drives, follow) -> None:
    """Without refinement the drift is large enough to be seen; the loop takes it out at the end of the tour."""
    drive = drives.drive(drives.rooms(), drives.ROOMS_TOUR, bias=0.003, scale=0.03, speed=0.5)
    errors = {}
    for close in (True, False):
        errors[close] = follow(karto(drive.robot, refine_match=False, do_loop_closing=close), drive).errors[-1]
    assert errors[False] > 0.02
    assert errors[True] < 0.5 * errors[False]


def test_the_map_stops_growing_where_all_is_mapped(karto, drives, two_rounds, follow) -> None:
    method = karto(two_rounds.robot)
    half = len(two_rounds.truth) // 2
    follow(method, drives.part(two_rounds, 0, half))
    after_one = method.map_summary().keyframes
    follow(method, drives.part(two_rounds, half, len(two_rounds.truth)))
    assert after_one > 60
    assert method.map_summary().keyframes - after_one < 0.15 * after_one


def test_without_reuse_every_gate_adds_a_keyframe(karto, two_rounds, follow) -> None:
    method = karto(two_rounds.robot, reuse_keyframes=False)
    done = follow(method, two_rounds)
    assert method.map_summary().keyframes == method.scans_matched + STANDING
    assert method.map_summary().keyframes > 200
    assert done.errors.max() < 0.03


def test_published_travel_distance_of_zero_takes_every_scan(karto, drives, two_rounds, follow) -> None:
    method = karto(two_rounds.robot, minimum_travel_distance=0.0)
    done = follow(method, drives.part(two_rounds, 0, 60))
    assert method.scans_matched == 60 - STANDING
    assert method.map_summary().keyframes == 60
    assert done.errors.max() < 0.02


def test_a_robot_that_stands_adds_no_keyframe_and_stays(karto, drives, follow) -> None:
    drive = drives.drive(drives.rooms(), drives.ROOMS_TOUR[:2], pause=20.0, speed=0.5)
    method = karto(drive.robot)
    done = follow(method, drive)
    still = done.estimates[-180:]
    assert method.map_summary().keyframes < 60
    assert np.ptp(still[:, :2], axis=0).max() < 0.01
    assert still[:, :2].std(axis=0).max() < 0.002


def test_the_first_scans_of_a_standing_robot_share_one_pose(karto, drives, two_rounds, follow) -> None:
    method = karto(two_rounds.robot)
    done = follow(method, drives.part(two_rounds, 0, STANDING + 1))
    assert not np.ptp(done.estimates, axis=0).any()
    assert np.abs(done.estimates[0]).max() < 1e-12
    assert method.map_summary().keyframes == STANDING + 1


def test_a_heading_error_of_the_first_scan_does_not_turn_the_map(karto, drives, follow) -> None:
    """With a single first scan the map is turned by up to 0.05 degrees, differently in each round."""
    walls = np.array(drives.box(0, 0, 9, 7) + drives.box(3, 3, 6, 4))
    turned = []
    for seed in range(4):
        drive = drives.drive(walls, np.array([(1.5, 1.5), (4.5, 1.5)]), seed=seed, speed=0.5)
        done = follow(karto(drive.robot), drive)
        turned.append(np.degrees(np.mean((done.estimates - done.truth)[20:, 2])))
    assert np.abs(turned).max() < 0.012


def test_a_corridor_is_as_long_as_odometry_and_door_frames_say(karto, drives, follow) -> None:
    drive = drives.drive(drives.corridor(36), np.array([(1.0, 1.0), (34.0, 1.0)]), speed=0.5)
    done = follow(karto(drive.robot), drive)
    across = np.abs((done.estimates - done.truth)[:, 1])
    assert across.max() < 0.02
    assert done.errors.max() < 0.004 * 33 + 0.02  # no worse than the odometry's 0.3 % along


def test_a_rolling_scan_is_deskewed_by_odometry(karto, drives, two_rounds, follow) -> None:
    walls = np.array(drives.box(0, 0, 9, 7) + drives.box(3, 3, 6, 4))
    drive = drives.drive(walls, np.array([(1.5, 1.5), (7.5, 1.5), (7.5, 5.5)]), rolling=True, speed=0.5)
    deskewed = follow(karto(drive.robot), drive).errors.mean()
    skewed = follow(karto(drive.robot, deskew=False), drive).errors.mean()
    assert deskewed < 0.01
    assert deskewed < 0.5 * skewed


def test_a_carried_robot_is_reported_lost_and_mapping_goes_on(karto, drives, loop_drive, follow) -> None:
    carried = drives.joined(drives.part(loop_drive, 0, 300), drives.part(loop_drive, 900, 1100))
    done = follow(karto(carried.robot), carried)
    assert np.isfinite(done.estimates).all()
    assert "lost" not in done.statuses[:300]
    assert "lost" in done.statuses[300:303]
    assert set(done.statuses[-50:]) == {"tracking"}


def test_a_small_push_is_found_by_matching(karto, drives, follow) -> None:
    """Pushed 15 cm aside, which odometry does not see: within the correlation window of a quarter of a metre."""
    walls = drives.rooms()
    here = drives.drive(walls, np.array([(1.1, 1.1), (4.0, 1.1)]))
    there = drives.drive(walls, np.array([(4.0, 1.25), (6.0, 1.25)]), seed=1)
    pushed = drives.joined(here, there)
    done = follow(karto(pushed.robot), pushed)
    pose = done.estimates[-1]
    assert pose[1] == pytest.approx(0.15, abs=0.02)
