"""The published waypoints, driven with a perfect pose: what is left is the control error of the navigation alone."""

import numpy as np
import pytest

from taskslam.geometry import SE2
from taskslam.outcomes import Outcome
from taskslam.world.map_server import load_floor_plan

CONTACT = 0.178

# start pose and the lower bound of a round at 0.3 m/s with pauses (protocol 6.2, 6.3)
TOURS = {"aws_small_house": (SE2(0.0, 0.0, 0.0), 213.0), "aws_small_warehouse": (None, 302.0)}


@pytest.mark.parametrize("world", TOURS)
def test_every_waypoint_is_reached_without_contact(data, simulate, world):
    start, lower_bound = TOURS[world]
    plan = load_floor_plan(data / "maps" / f"{world}.yaml")
    waypoints = np.loadtxt(data / "waypoints" / world / "waypoints.txt")[:, 1:]
    order = np.loadtxt(data / "waypoints" / world / "path0.txt", dtype=int)
    simulation = simulate(plan, start if start is not None else SE2(*waypoints[order[0]]))
    seconds = 0.0
    for index in order[1:]:
        drive = simulation.go(SE2(*waypoints[index]))
        assert drive.outcome is Outcome.REACHED, f"waypoint {index}: {drive.detail}"
        assert drive.clearance > CONTACT, f"waypoint {index}: {drive.clearance:.3f} m"
        simulation.idle(5.0)
        seconds += drive.seconds + 5.0
    assert seconds < 1.2 * lower_bound
