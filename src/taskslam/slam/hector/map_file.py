"""The map of `hector` on disk: the log-odds of every level and where they lie."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from taskslam.errors import RecordError
from taskslam.slam.hector.mapper import HectorMapper
from taskslam.slam.hector.occupancy_grid import LIMIT
from taskslam.slam.hector.settings import HectorSettings
from taskslam.slam.map_archive import Arrays, read_archive, write_archive

VERSION = 1


def write_map(path: Path, mapper: HectorMapper, settings: HectorSettings) -> None:
    """Write the map to `path`, whole or not at all.

    Raises:
        DiskFullError: the file cannot be written; says why.
    """
    arrays: Arrays = {"settings": np.array(settings.model_dump_json())}
    arrays["resolutions"] = np.array([level.resolution for level in mapper.levels])
    for number, level in enumerate(mapper.levels):
        arrays[f"log_odds_{number}"] = level.log_odds
        arrays[f"origin_{number}"] = level.origin
    write_archive(path, "hector", VERSION, arrays)


def read_map(path: Path, mapper: HectorMapper) -> None:
    """Fill an empty mapper with a saved map and place the robot at the map's start.

    Raises:
        RecordError: the file is absent, truncated, of another kind or version, of other resolutions than the mapper's,
            or contradicts itself; says which.
    """
    numbers = range(len(mapper.levels))
    names = {f"log_odds_{n}" for n in numbers} | {f"origin_{n}" for n in numbers} | {"resolutions"}
    arrays = read_archive(path, "hector", VERSION, {"resolutions"})
    resolutions = [level.resolution for level in mapper.levels]
    found = arrays["resolutions"]
    if found.dtype.kind != "f" or found.shape != (len(resolutions),) or not np.allclose(found, resolutions):
        raise RecordError(f"{path}: hector map with cells of {found.tolist()} m, expected {resolutions} m")
    arrays = read_archive(path, "hector", VERSION, names)
    for number, level in enumerate(mapper.levels):
        log_odds, origin = arrays[f"log_odds_{number}"], arrays[f"origin_{number}"]
        whole = origin.shape == (2,) and np.allclose(origin / level.resolution, np.round(origin / level.resolution))
        if log_odds.dtype != np.float32 or log_odds.ndim != 2 or not whole or (np.abs(log_odds) > LIMIT).any():
            raise RecordError(f"{path}: hector map contradicts itself: level {number} is no grid of log-odds")
        level.restore(log_odds, origin)
    if mapper.empty:
        raise RecordError(f"{path}: hector map without a scan: nothing was mapped before it was saved")
    mapper.place(np.zeros(3))
