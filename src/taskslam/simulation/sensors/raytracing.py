"""Rays against triangles, by Intel Embree (through embreex).

The one place that talks to Embree; LiDARs and previews call it. Rays are float32, as Embree's are. Coordinates in
the world frame, metres.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from embreex.mesh_construction import TriangleMesh as EmbreeMesh
from embreex.rtcore_scene import EmbreeScene

from taskslam.world import TriangleMesh

_MISS = np.float32(1e37)  # embreex leaves 1e37 as the distance of a ray that meets nothing


class RayCaster:
    """A triangle mesh prepared for ray queries."""

    def __init__(self, mesh: TriangleMesh) -> None:
        self.scene = EmbreeScene()
        self._mesh = EmbreeMesh(self.scene, np.ascontiguousarray(mesh.corners(), dtype=np.float32))

    def distances(
        self, origins: npt.NDArray[np.float32], directions: npt.NDArray[np.float32]
    ) -> npt.NDArray[np.float32]:
        """(N,) distance to the first triangle along each ray, in units of the direction's length; +inf for none.

        origins, directions: (N, 3) float32, C-contiguous.
        """
        if len(origins) == 0:
            return np.empty(0, np.float32)
        found: npt.NDArray[np.float32] = self.scene.run(origins, directions, query="DISTANCE")
        found[found >= _MISS] = np.inf
        return found

    def hits(
        self, origins: npt.NDArray[np.float32], directions: npt.NDArray[np.float32]
    ) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.float32], npt.NDArray[np.float32]]:
        """Triangle index (N,) (-1 for none), distance (N,) and barycentric u, v (N, 2) of each ray's first hit."""
        found = self.scene.run(origins, directions, output=1)
        triangle = np.asarray(found["primID"], dtype=np.int32)
        distance = np.asarray(found["tfar"], dtype=np.float32).copy()
        distance[triangle < 0] = np.inf
        return triangle, distance, np.stack([found["u"], found["v"]], axis=1).astype(np.float32)
