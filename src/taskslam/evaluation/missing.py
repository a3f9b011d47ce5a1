"""Arrivals that the measurement lost: cells of NaN in a table of rounds and waypoints.

A robot arrived, and the camera was off: that says nothing about the robot, so it is missing data. A waypoint keeps the
m of its M visits that were measured, as long as they are two. Its mean has the variance of m values, and a table for
the two-way analysis must say so. Therefore a column of m known values x_j is filled to M values of the same mean and
the same variance of the mean:

    known     mean + w (x_j - mean),   w = sqrt(M (M - 1) / (m (m - 1)))
    missing   mean

since sum_j (w (x_j - mean))^2 / (M (M - 1)) = sum_j (x_j - mean)^2 / (m (m - 1)). What rounds have in common at several
waypoints stays in its rows; the covariance of a whole column and one of m values comes out as sqrt(M (m - 1) / (m (M -
1))) of what it is, 0.97 for m = 4 of M = 5. That rounds are lost by chance, whatever the robot did, is assumed.
Without a missing cell every function here gives, bit for bit, what the plain formula does.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from taskslam.geometry import FloatArray

FEWEST = 2
"""Known values of a waypoint below which it has no scatter to judge."""


def filled(tables: FloatArray) -> FloatArray | None:
    """(..., M, N') tables of which no cell is missing, from (..., M, N) ones.

    A column with fewer than two known values has no variance of its own and is left out: the variance of the mean is
    then that of the mean of the others, which is a little larger. None if no column is left. A cell is missing in all
    tables or in none.
    """
    missing = np.isnan(tables)
    if not missing.any():
        return tables
    M = tables.shape[-2]
    columns = (~missing).reshape(-1, *tables.shape[-2:])[0].sum(axis=0) >= FEWEST
    if not columns.any():
        return None
    tables = tables[..., columns]
    m = known_rounds(tables, axis=-2)[..., None, :]
    mean = column_mean(tables, axis=-2)
    weight = np.where(m < M, np.sqrt(M * (M - 1) / (m * (m - 1))), 1.0)
    return np.where(np.isnan(tables), mean, np.where(m < M, mean + weight * (tables - mean), tables))


def known_rounds(values: FloatArray, axis: int) -> npt.NDArray[np.int64]:
    """How many values along an axis are not NaN."""
    return np.asarray((~np.isnan(values)).sum(axis=axis))


def column_mean(values: FloatArray, axis: int) -> FloatArray:
    """Mean over an axis, which is kept, of what is not NaN; NaN without a value."""
    with np.errstate(invalid="ignore"):
        known = (~np.isnan(values)).sum(axis=axis, keepdims=True)
        return np.asarray(np.nansum(values, axis=axis, keepdims=True) / known)


def circular_mean(headings: FloatArray) -> FloatArray:
    """Circular mean (N,) of what is not NaN of (M, N) headings, rad."""
    return np.asarray(np.arctan2(np.nansum(np.sin(headings), axis=0), np.nansum(np.cos(headings), axis=0)))
