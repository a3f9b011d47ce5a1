"""Wheel odometry of the last seconds, read at any instant.

Between samples by interpolation, after the newest by its velocity.
"""

from __future__ import annotations

import bisect

import numpy as np
import numpy.typing as npt

from taskslam.geometry import SE2, FloatArray, compose
from taskslam.measurements import NANOSECONDS, WheelOdometry

_KEPT = 256  # samples: 5 s at 50 Hz, longer than any scan lags behind


class OdometryHistory:
    """The newest odometry samples, oldest first."""

    def __init__(self) -> None:
        self._stamps: list[int] = []
        self._samples: list[WheelOdometry] = []

    def __len__(self) -> int:
        return len(self._stamps)

    def add(self, sample: WheelOdometry) -> None:
        """Keep a sample; one that is not newer than the last, or not finite, is ignored."""
        if not sample.T_odom_base.is_finite() or (self._stamps and sample.stamp <= self._stamps[-1]):
            return
        self._stamps.append(sample.stamp)
        self._samples.append(sample)
        if len(self._stamps) >= 2 * _KEPT:
            del self._stamps[:_KEPT], self._samples[:_KEPT]

    def at(self, stamp: int) -> SE2:
        """`T_odom_base` at an instant in ns. Raises IndexError while there is no sample at all."""
        x, y, theta = self.at_many(np.array([stamp], np.int64))[0]
        return SE2(float(x), float(y), float(theta))

    def at_many(self, stamps: npt.NDArray[np.int64]) -> FloatArray:
        """(N, 3) poses at (N,) instants in ns."""
        out = np.empty((len(stamps), 3))
        for row, stamp in enumerate(stamps):
            i = bisect.bisect_right(self._stamps, int(stamp)) - 1
            base = self._samples[max(i, 0)]
            seconds = (int(stamp) - base.stamp) / NANOSECONDS
            if 0 <= i < len(self._samples) - 1:
                following = self._samples[i + 1]
                share = (int(stamp) - base.stamp) / (following.stamp - base.stamp)
                step = base.T_odom_base.inverse() @ following.T_odom_base
                out[row] = (base.T_odom_base @ SE2(share * step.x, share * step.y, share * step.theta)).array()
            else:
                seconds = min(max(seconds, -0.2), 0.2)
                turn = base.angular * seconds
                ahead = base.linear * seconds
                out[row] = (base.T_odom_base @ SE2(ahead * np.cos(turn / 2), ahead * np.sin(turn / 2), turn)).array()
        return out

    def motion_within(self, stamp: int, offsets: npt.NDArray[np.int64]) -> FloatArray:
        """(N, 3) poses of the base at stamp + offsets (ns, rising), seen from the base at stamp: what deskewing needs.

        Read at 9 instants and interpolated linearly in between: within one turn of a LiDAR the motion is smooth.
        """
        knots = np.linspace(offsets[0], offsets[-1], 9)
        poses = self.at_many((stamp + knots).astype(np.int64))
        start = self.at(stamp).inverse().array()
        relative = compose(np.broadcast_to(start, poses.shape), poses)
        return np.stack([np.interp(offsets, knots, relative[:, k]) for k in range(3)], axis=1)
