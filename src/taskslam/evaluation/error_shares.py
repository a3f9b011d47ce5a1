"""What an arrival error is made of: control error and estimation error, apart (protocol 7.3 #9).

Navigation stops where SLAM says that the goal is reached, anywhere inside its tolerance. So the true error is the sum
of two: where the robot believes it stands against the goal (control), and where it really stands against where it
believes it stands (estimation). The first is the controller's doing, the second the SLAM method's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taskslam.evaluation.waypoints import known_mean
from taskslam.geometry import FloatArray, wrap


@dataclass(frozen=True, slots=True)
class PoseError:
    """Means over visits, of shape (...): position_m of the distance, heading_rad of the absolute angle.

    spread_m: mean distance of the error vectors to their own mean. That part differs from round to round, so it limits
    precision; the rest is a repeatable bias and only limits accuracy. NaN without a visit, the spread below two.
    """

    position_m: FloatArray
    heading_rad: FloatArray
    spread_m: FloatArray


def control_error(estimates: FloatArray, goal: FloatArray) -> PoseError:
    """SLAM-estimated poses (..., V, 3) at the end of each visit against the goal (..., 3), in one frame."""
    return _error(estimates, goal[..., None, :])


def estimation_error(estimates: FloatArray, truths: FloatArray) -> PoseError:
    """SLAM-estimated poses (..., V, 3) against true poses (..., V, 3) of the same visits, in one frame."""
    return _error(estimates, truths)


def _error(poses: FloatArray, references: FloatArray) -> PoseError:
    """A visit of which either pose is NaN is left out."""
    dx, dy = poses[..., 0] - references[..., 0], poses[..., 1] - references[..., 1]
    spread = np.hypot(dx - known_mean(dx)[..., None], dy - known_mean(dy)[..., None])
    return PoseError(
        position_m=known_mean(np.hypot(dx, dy)),
        heading_rad=known_mean(np.abs(wrap(poses[..., 2] - references[..., 2]))),
        spread_m=known_mean(spread, fewest=2),
    )
