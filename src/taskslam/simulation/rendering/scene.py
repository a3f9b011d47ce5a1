"""What a pinhole in a world sees: light, depth and triangle of every pixel, in one pass over the visible triangles."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from taskslam.errors import WorldError
from taskslam.geometry import FloatArray, invert_se3, is_rigid
from taskslam.simulation.rendering.pixel_shading import shade
from taskslam.simulation.rendering.rasterizer import CutOuts, Pinhole, rasterize, visible_blocks
from taskslam.simulation.rendering.scene_cache import prepared
from taskslam.world import World


@dataclass(frozen=True)
class View:
    """One rendered picture.

    radiance_root: (H, W) float32, or (H, W, 3) in colour: square root of linear light, not yet exposed; drawn: (H, W)
    int32 index into `source`, -1 where nothing is seen; source: (T,) int32 index into `World.visual`; inverse_depth:
    (H, W) float32, 1 / m along the optical axis where something is seen.
    """

    radiance_root: npt.NDArray[np.float32]
    drawn: npt.NDArray[np.int32]
    source: npt.NDArray[np.int32]
    inverse_depth: npt.NDArray[np.float32]

    def depth(self) -> npt.NDArray[np.float32]:
        """(H, W) float32 m along the optical axis, +inf where nothing stands between near and far."""
        return np.where(self.drawn >= 0, np.float32(1.0) / self.inverse_depth, np.float32(np.inf))

    def triangle(self) -> npt.NDArray[np.int32]:
        """(H, W) int32 index into `World.visual`, -1 where nothing is seen."""
        named: npt.NDArray[np.int32] = np.append(self.source, np.int32(-1))[self.drawn]  # index -1 finds the last
        return named


@dataclass(frozen=True)
class _SeenFrom:
    """A camera's place: rotation (3, 3) from world to its optical frame, position (3,) m; blocks in view in order."""

    rotation: FloatArray
    position: FloatArray
    order: npt.NDArray[np.int64]


class Scene:
    """A world made ready for rendering, grey or in colour; it may be shared by cameras and threads."""

    def __init__(self, world: World, color: bool = False) -> None:
        self._ready = ready = prepared(world, color)
        atlas, entry = ready.atlas, ready.entry
        holed = np.where(atlas.holes[entry], entry, -1).astype(np.int32) if len(entry) else entry
        self._cut_outs = CutOuts(holed, ready.texel_uv, atlas.opacity, atlas.offset, atlas.width, atlas.height)

    @property
    def nbytes(self) -> int:
        """Bytes of all arrays."""
        b, a, light = self._ready.blocks, self._ready.atlas, self._ready.light
        arrays = (b.vertices, b.triangles, b.source, b.low, b.high, a.planes, a.opacity)
        more = (self._ready.texel_uv, self._ready.entry, self._cut_outs.entry, light.values, light.offset, light.cells)
        return sum(array.nbytes for array in arrays + more)

    def view(self, T_world_camera: FloatArray, pinhole: Pinhole, threads: int = 1) -> View:
        """What a pinhole at `T_world_camera` (4, 4), the pose of its optical frame, sees.

        Bands of rows are shared among threads; every pixel is worked out alone, so that their number changes nothing.
        Poses (B, 4, 4) are those of B bands of rows from top to bottom: a rolling shutter.

        Raises:
            WorldError: a pose is not a rigid transform.
        """
        poses = np.reshape(T_world_camera, (-1, 4, 4))
        if not all(map(is_rigid, poses)):
            raise WorldError("camera: T_world_camera is not a finite rigid (4, 4) transform")
        shape = (pinhole.height, pinhole.width)
        inverse_depth, drawn = np.empty(shape, np.float32), np.empty(shape, np.int32)
        blocks = self._ready.blocks
        planes = np.empty((len(self._ready.atlas.planes), *shape), np.float32)
        seen_from = [self._seen_from(pose, pinhole) for pose in poses]

        def band(rows: tuple[int, int], one: _SeenFrom) -> None:
            place = one.rotation, one.position, pinhole
            rasterize(blocks, one.order, self._cut_outs, *place, rows, inverse_depth, drawn)
            for plane in range(len(planes)):
                self._shade(plane, drawn, *place, rows, planes[plane])

        count = max(1, threads) if len(poses) == 1 else len(poses)
        edges = np.linspace(0, pinhole.height, count + 1).astype(int)
        bands = [(int(a), int(b)) for a, b in pairwise(edges)]
        views = seen_from * (count // len(poses))
        if threads <= 1:
            for rows, one in zip(bands, views, strict=True):
                band(rows, one)
        else:
            with ThreadPoolExecutor(threads) as pool:
                list(pool.map(band, bands, views))
        light = planes[0] if len(planes) == 1 else np.moveaxis(planes, 0, 2)
        return View(light, drawn, blocks.source, inverse_depth)

    def _seen_from(self, T_world_camera: FloatArray, pinhole: Pinhole) -> _SeenFrom:
        rotation = np.ascontiguousarray(invert_se3(T_world_camera)[:3, :3])
        position = np.ascontiguousarray(T_world_camera[:3, 3], dtype=np.float64)
        return _SeenFrom(rotation, position, visible_blocks(self._ready.blocks, rotation, position, pinhole))

    def _shade(
        self,
        plane: int,
        drawn: npt.NDArray[np.int32],
        rotation: FloatArray,
        position: FloatArray,
        pinhole: Pinhole,
        rows: tuple[int, int],
        out: npt.NDArray[np.float32],
    ) -> None:
        ready = self._ready
        blocks, atlas, light = ready.blocks, ready.atlas, ready.light
        shade(
            drawn,
            blocks.vertices,
            blocks.triangles,
            ready.entry,
            ready.texel_uv,
            light.cells,
            light.offset,
            light.values[plane],
            atlas.planes[plane],
            atlas.offset,
            atlas.width,
            atlas.height,
            rotation,
            position,
            pinhole.numbers(),
            ready.background[plane],
            rows[0],
            rows[1],
            out,
        )


def render(world: World, T_world_camera: FloatArray, pinhole: Pinhole, color: bool = False, threads: int = 1) -> View:
    """One view of a world; for many views, keep a `Scene`. Raises as `Scene.view` does."""
    return Scene(world, color).view(T_world_camera, pinhole, threads)


def depth_image(view: View) -> npt.NDArray[np.float32]:
    """(H, W) float32 m along the optical axis as depth cameras give it: 0 where nothing was measured."""
    return np.where(view.drawn >= 0, np.float32(1.0) / view.inverse_depth, np.float32(0.0))
