"""The shape of a violin."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray


def kernel_density(values: npt.ArrayLike, at: npt.ArrayLike) -> FloatArray:
    """(G,) Gaussian kernel density of (N,) values at (G,) places, with Scott's bandwidth, s N^(-1/5) in one dimension.

    Scott, "Multivariate Density Estimation" (1992). Raises ValueError for fewer than two values or all alike.
    """
    sample = np.asarray(values, dtype=np.float64)
    if len(sample) < 2 or np.ptp(sample) == 0:
        raise ValueError("a density needs values that differ; expected at least two")
    bandwidth = sample.std(ddof=1) * len(sample) ** (-1 / 5)
    z = (np.asarray(at, dtype=np.float64)[:, None] - sample[None, :]) / bandwidth
    return np.asarray(np.exp(-0.5 * z**2).sum(axis=1) / (len(sample) * bandwidth * np.sqrt(2 * np.pi)))
