"""A method of a 3D LiDAR fed in this process with the conformance drive."""

from dataclasses import dataclass

import numpy as np
import pytest

from taskslam.geometry import SE2
from taskslam.measurements import NANOSECONDS
from taskslam.slam.conformance_drive import ConformanceDrive


@dataclass
class Followed:
    """estimates: all of them; errors: m, planar, of those that track, against the truth at their own stamps."""

    estimates: list
    errors: np.ndarray


@pytest.fixture(scope="session")
def follow():
    """Drives a started method for so many seconds; change: what is done to each measurement before it is fed."""

    def run(method, rig, seconds, change=lambda m: m):
        drive = ConformanceDrive(rig, sensors=method.card.sensors)
        fed = (m for m in drive.measurements(0, round(seconds * NANOSECONDS)) if m.sensor in method.card.sensors)
        answers = [method.feed(change(m)) for m in fed]
        estimates = [answer for answer in answers if answer is not None]
        tracked = [e for e in estimates if e.status == "tracking"]
        errors = [drive.pose(e.stamp).distance_to(SE2.from_matrix(e.T_start_base)) for e in tracked]
        return Followed(estimates, np.array(errors))

    return run
