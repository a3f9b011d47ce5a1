"""The map of `karto` on disk: one npz of plain arrays (nothing pickled), with a version and the settings in JSON."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from taskslam.errors import RecordError
from taskslam.slam.karto.mapper import Mapper
from taskslam.slam.karto.pose_graph import Edge
from taskslam.slam.karto.scan_points import ScanPoints
from taskslam.slam.karto.settings import KartoSettings
from taskslam.slam.map_archive import Arrays, read_archive, write_archive

VERSION = 1
_NAMES = {"settings", "poses", "sizes", "points", "normals", "sensors"}
_NAMES |= {"edge_ends", "edge_strong", "edge_poses", "edge_covariances"}


def write_map(path: Path, mapper: Mapper, settings: KartoSettings) -> None:
    """Write the map to `path`, whole or not at all.

    Raises:
        DiskFullError: the file cannot be written; says why.
    """
    frames, edges = mapper.keyframes, mapper.graph.edges
    scans = [frames.scan(k) for k in range(len(frames))]
    write_archive(
        path,
        "karto",
        VERSION,
        {
            "settings": np.array(settings.model_dump_json()),
            "poses": frames.poses,
            "sizes": np.array([len(scan) for scan in scans], np.int64),
            "points": np.concatenate([scan.points for scan in scans]) if scans else np.zeros((0, 2), np.float32),
            "normals": np.concatenate([scan.normals for scan in scans]) if scans else np.zeros((0, 2), np.float32),
            "sensors": np.array([scan.sensor for scan in scans]).reshape(-1, 2),
            "edge_ends": np.array([(e.source, e.target) for e in edges], np.int64).reshape(-1, 2),
            "edge_strong": np.array([e.strong for e in edges], np.bool_),
            "edge_poses": np.array([e.T_source_target for e in edges]).reshape(-1, 3),
            "edge_covariances": np.array([e.covariance for e in edges]).reshape(-1, 3, 3),
        },
    )


def read_map(path: Path, mapper: Mapper) -> None:
    """Fill an empty mapper with a saved map and place the robot at the map's start.

    Raises:
        RecordError: the file is absent, truncated, of another kind or version, or contradicts itself; says which.
    """
    arrays = read_archive(path, "karto", VERSION, _NAMES)
    _check(path, arrays)
    ends = np.cumsum(arrays["sizes"])[:-1]
    points, normals = np.split(arrays["points"], ends), np.split(arrays["normals"], ends)
    for scan_points, scan_normals, sensor, pose in zip(
        points, normals, arrays["sensors"], arrays["poses"], strict=True
    ):
        mapper.keyframes.add(ScanPoints(scan_points, scan_normals, sensor), pose)
        mapper.graph.add_vertex()
    for (source, target), strong, pose, covariance in zip(
        arrays["edge_ends"].tolist(),
        arrays["edge_strong"].tolist(),
        arrays["edge_poses"],
        arrays["edge_covariances"],
        strict=True,
    ):
        mapper.graph.add_edge(Edge(source, target, pose, covariance, strong))
    mapper.place(np.zeros(3))


def _check(path: Path, arrays: Arrays) -> None:
    count, edges = len(arrays["poses"]), len(arrays["edge_ends"])
    if arrays["sizes"].dtype.kind != "i" or arrays["edge_ends"].dtype.kind != "i" or (arrays["sizes"] < 0).any():
        raise RecordError(f"{path}: karto map contradicts itself: sizes and edge_ends must be whole numbers from 0")
    hits = int(arrays["sizes"].sum())
    shapes = {
        "poses": (count, 3),
        "sizes": (count,),
        "points": (hits, 2),
        "normals": (hits, 2),
        "sensors": (count, 2),
        "edge_ends": (edges, 2),
        "edge_strong": (edges,),
        "edge_poses": (edges, 3),
        "edge_covariances": (edges, 3, 3),
    }
    for name, shape in shapes.items():
        if arrays[name].shape != shape:
            raise RecordError(f"{path}: karto map contradicts itself: {name} is {arrays[name].shape}, expected {shape}")
    if count == 0:
        raise RecordError(f"{path}: karto map without keyframes: nothing was mapped before it was saved")
    if edges and not 0 <= arrays["edge_ends"].min() <= arrays["edge_ends"].max() < count:
        raise RecordError(f"{path}: karto map with an edge to a keyframe that is not in it")
