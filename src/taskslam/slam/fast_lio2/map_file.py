"""The map of `fast_lio2` on disk: its points, in the frame in which the IMU started."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from taskslam.errors import RecordError
from taskslam.slam.fast_lio2.settings import FastLio2Settings
from taskslam.slam.fast_lio2.voxel_map import VoxelMap
from taskslam.slam.map_archive import Arrays, read_archive, write_archive

VERSION = 1
_LARGEST_M = 1e5


def write_map(path: Path, kept: VoxelMap, settings: FastLio2Settings) -> None:
    """Write the map to `path`, whole or not at all.

    Raises:
        DiskFullError: the file cannot be written; says why.
    """
    arrays: Arrays = {
        "settings": np.array(settings.model_dump_json()),
        "size": np.array(kept.size),
        "points": kept.all_points(),
    }
    write_archive(path, "fast_lio2", VERSION, arrays)


def read_map(path: Path, into: VoxelMap) -> None:
    """Fill an empty map with a saved one.

    Raises:
        RecordError: the file is absent, truncated, of another kind or version, of voxels of another size, or
            contradicts itself; says which.
    """
    arrays = read_archive(path, "fast_lio2", VERSION, {"size", "points"})
    size, points = arrays["size"], arrays["points"]
    if size.dtype.kind != "f" or size.shape != () or not np.isclose(float(size), into.size):
        raise RecordError(f"{path}: fast_lio2 map with voxels of {size} m, expected {into.size:g} m (filter_size_map)")
    if points.dtype != np.float64 or points.ndim != 2 or points.shape[1] != 3 or (np.abs(points) > _LARGEST_M).any():
        raise RecordError(f"{path}: fast_lio2 map contradicts itself: no table of points")
    into.insert(points)
    if len(into) != len(points) or not len(points):
        raise RecordError(f"{path}: fast_lio2 map contradicts itself: {len(points)} points in {len(into)} voxels")
