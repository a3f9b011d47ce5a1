"""What an arrival error is made of: control error and estimation error, apart (protocol 7.3 #9).

Navigation stops where SLAM says that the goal is reached, anywhere inside its tolerance. So the true error is the sum
of two: where the robot believes it stands against the goal (control), and where it really stands against where it
believes it stands (estimation). The first is the controller's doing, the second the SLAM method's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from taskslam.geometry import FloatArray, wrap


@dataclass(frozen=True, slots=True)
class PoseError:
    """Means over visits: position_m of the distance, heading_rad of the absolute angle.

    spread_m: mean distance of the error vectors to their own mean. That part differs from round to round, so it limits
    precision; the rest is a repeatable bias and only limits accuracy.
    """

    position_m: float
    heading_rad: float
    spread_m: float


def control_error(estimates: FloatArray, goal: FloatArray) -> PoseError:
    """SLAM-estimated poses (V, 3) at the end of each visit against the goal (3,), in one frame."""
    return _error(estimates, np.broadcast_to(goal, estimates.shape))


def estimation_error(estimates: FloatArray, truths: FloatArray) -> PoseError:
    """SLAM-estimated poses (V, 3) against true poses (V, 3) of the same visits, in one frame."""
    return _error(estimates, truths)


def _error(poses: FloatArray, references: FloatArray) -> PoseError:
    """NaN without a visit; the spread is NaN below two."""
    if not len(poses):
        return PoseError(math.nan, math.nan, math.nan)
    offsets = poses[:, :2] - references[:, :2]
    around_mean = offsets - offsets.mean(axis=0)
    return PoseError(
        position_m=float(np.hypot(*offsets.T).mean()),
        heading_rad=float(np.abs(wrap(poses[:, 2] - references[:, 2])).mean()),
        spread_m=float(np.hypot(*around_mean.T).mean()) if len(poses) > 1 else math.nan,
    )
