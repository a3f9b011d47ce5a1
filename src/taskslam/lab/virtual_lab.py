"""The virtual lab: a finished simulated run, photographed as a real tour would be.

The run's journal and its true trajectory say where the robot was; cameras overhead see the tag on its top, or a camera
on the robot sees tags on the ceiling. What is written is what a real tour leaves behind (pictures, calibrations, logs
of arrivals, setup files), and apart from it the truth, against which what was measured can be held. Nothing in the
loop is touched, so any method's run will do.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from taskslam.errors import InputError, RecordError
from taskslam.files import writing
from taskslam.geometry import SE2, FloatArray, invert_se3
from taskslam.lab.ceiling import with_ceiling
from taskslam.lab.folder import (
    OVERHEAD,
    TRUTH,
    UP,
    unix,
    write_logs,
    write_setups,
    write_table,
    write_truth,
)
from taskslam.lab.image import SAMPLES, Body, Cards, draw, sheet
from taskslam.lab.lab_file import Lab, LabOverheadCamera
from taskslam.lab.lens import Backdrop, backdrop, covering_pinhole, natural_vignetting, pixel_corners
from taskslam.lab.robot import robot_cylinders
from taskslam.lab.shot import Development, develop_photo, gain_for, jpeg, soften
from taskslam.lab.tour import Kept, RelivedTour, Shutter, relive, shutters
from taskslam.observer import Observer
from taskslam.realworld.cameras.camera_model import Camera
from taskslam.realworld.setup_file import BundleTag, Place
from taskslam.realworld.tags.tag_family import code_cells
from taskslam.realworld.tags.tag_plane import tag_square
from taskslam.record import RunRecord
from taskslam.record.place import whole_folder
from taskslam.robot import Robot
from taskslam.scenario import Scenario
from taskslam.simulation.rendering.scene import Scene
from taskslam.simulation.streams import stream
from taskslam.world import World

Light = npt.NDArray[np.float32]

_IN_SIGHT = 2.0  # of the ceiling's height: tags farther aside are not drawn
_QUIET = 1  # cells of white around a tag
_FACE_DOWN = np.diag([1.0, -1.0, -1.0, 1.0])  # a sheet on the ceiling: its top is kept, its front looks down


@dataclass(frozen=True)
class Picture:
    """One photograph. ids: of the tags near by; corners: (N, 4, 2) px, their true TL, TR, BR, BL, NaN if behind."""

    shutter: Shutter
    ids: tuple[int, ...]
    corners: FloatArray
    file: bytes


def scenario_of(record: RunRecord) -> Scenario:
    """The scenario that a simulated run was driven in. Raises InputError for any other run."""
    try:
        return Scenario.model_validate(record.manifest.scenario)
    except ValidationError as error:
        raise InputError(
            f"{record.directory}: no scenario of a simulated run; the lab relives only such runs"
        ) from error


def photograph(
    record: RunRecord, world: World, robot: Robot, lab: Lab, out: Path, observer: Observer | None = None
) -> list[Path]:
    """Write everything that a tour through the lab leaves behind, whole or not at all; the paths of the setup files.

    Raises:
        InputError: the run is of another scenario, holds no arrival or no truth, or has fewer waypoints than the lab.
        RecordError: `out` exists already and is not empty.
    """
    watch = observer or Observer()
    _check(record, lab, out)
    tour = relive(record, lab.sway.sway, lab.seed)
    with whole_folder(out) as folder:
        setups = _photograph(tour, world, robot, lab, folder, watch)
        names = [setup.relative_to(folder) for setup in setups]
    return [out / name for name in names]


def _photograph(tour: RelivedTour, world: World, robot: Robot, lab: Lab, out: Path, watch: Observer) -> list[Path]:
    write_logs(tour, lab, out)
    rows: list[list[object]] = []
    if lab.cameras:
        watch.stage("lighting the scene")
        scene = Scene(world)
        for camera in lab.cameras:
            watch.stage(f"camera {camera.name}")
            rows += _store(outside_in(tour, scene, robot, lab, camera), lab, camera.clock_offset, out, camera.name)
    if lab.ceiling is not None:
        watch.stage("camera up")
        rows += _store(inside_out(tour, world, lab), lab, lab.ceiling.camera.clock_offset, out, None)
    write_table(out / TRUTH / "pictures.csv", ("file", "time", "round", "waypoint", "tags", "corners_px"), rows)
    write_truth(tour, lab, out)
    return write_setups(tour, lab, out)


def outside_in(tour: RelivedTour, scene: Scene, robot: Robot, lab: Lab, camera: LabOverheadCamera) -> Iterator[Picture]:
    """What one camera overhead photographs and its recorder keeps, in time order."""
    tag = lab.tag
    assert tag is not None
    eye = _Eye(camera.lens.camera(camera.name), lab)
    T_camera_map = invert_se3(camera.mount.T_map_camera)
    behind = backdrop(scene, camera.mount.T_map_camera, eye.rays, eye.pinhole)
    still = eye.softened(behind.radiance)
    develop = eye.development(behind)
    T_base_tag = _placed(tag.mount, tag.height)
    looks = np.stack([sheet(code_cells(tag.family, tag.id), _QUIET)])
    cylinders = robot_cylinders(robot.footprint.radius, min(robot.footprint.height, tag.height) - 0.01, tag.height)
    photo = lab.photo
    goals = [waypoint - 1 for waypoint in camera.waypoints]
    kept = Kept(photo.heartbeat)
    for shutter in shutters(tour, goals, photo.rate, photo.before, photo.after, photo.dropped, lab.seed, camera.name):
        bases = T_camera_map @ tour.motions[shutter.round].poses(eye.instants(shutter.time))
        corners = eye.corners(bases @ T_base_tag, tag_square(tag.size, from_above=True))[None]
        if not kept.keeps(shutter.time, corners, eye.camera):
            continue
        cards = Cards(looks, sheet_side(tag.size, looks), (bases @ T_base_tag)[:, None])
        light, box = draw(behind, eye.rays, photo.light, cards, Body(cylinders, bases))
        image = develop_photo(soften(light, photo.softness, box, still), develop, eye.key())
        yield Picture(shutter, (tag.id,), corners, jpeg(image, photo.quality))


def inside_out(tour: RelivedTour, world: World, lab: Lab) -> Iterator[Picture]:
    """What the camera on the robot photographs and its recorder keeps, in time order."""
    ceiling = lab.ceiling
    assert ceiling is not None
    scene = Scene(with_ceiling(world, ceiling.height) if ceiling.build else world)
    eye = _Eye(ceiling.camera.lens.camera("up"), lab)
    T_base_camera = ceiling.camera.mount.T_base_camera
    tags = [
        (_placed(bundle.place, ceiling.height) @ _FACE_DOWN @ _in_bundle(tag), tag, bundle.family)
        for bundle in ceiling.bundles
        for tag in bundle.square.tags
    ]
    sizes = {tag.size for _, tag, _ in tags}
    if len(sizes) != 1:
        raise InputError(f"lab {lab.name}: ceiling tags of {len(sizes)} sizes; expected one")
    size = sizes.pop()
    looks = np.stack([sheet(code_cells(family, tag.id), _QUIET) for _, tag, family in tags])
    T_map_cards = np.stack([T for T, _, _ in tags])
    photo = lab.photo
    goals = [waypoint - 1 for bundle in ceiling.bundles for waypoint in bundle.waypoints]
    kept, square = Kept(photo.heartbeat), tag_square(size, from_above=True)
    develop: Development | None = None
    for shutter in shutters(tour, goals, photo.rate, photo.before, photo.after, photo.dropped, lab.seed, "up"):
        cameras = tour.motions[shutter.round].poses(eye.instants(shutter.time)) @ T_base_camera
        near = np.flatnonzero(np.hypot(*(T_map_cards[:, :2, 3] - cameras[0, :2, 3]).T) < _IN_SIGHT * ceiling.height)
        T_camera_cards = np.stack([invert_se3(T) for T in cameras])[:, None] @ T_map_cards[near]
        corners = np.array([eye.corners(T_camera_cards[:, n], square) for n in range(len(near))]).reshape(-1, 4, 2)
        if not kept.keeps(shutter.time, corners, eye.camera):
            continue
        behind = backdrop(scene, cameras[SAMPLES // 2], eye.rays, eye.pinhole)
        develop = develop or eye.development(behind)
        cards = Cards(looks[near], sheet_side(size, looks), T_camera_cards)
        light, _ = draw(behind, eye.rays, photo.light, cards, None)
        image = develop_photo(eye.softened(light), develop, eye.key())
        yield Picture(shutter, tuple(tags[n][1].id for n in near), corners, jpeg(image, photo.quality))


def sheet_side(size: float, looks: Light) -> float:
    """Side of a printed sheet, m, whose tag measures `size` between the outer edges of its black border."""
    cells = int(looks.shape[1])
    return size * cells / (cells - 2 * _QUIET)


def _store(pictures: Iterator[Picture], lab: Lab, offset: float, out: Path, camera: str | None) -> list[list[object]]:
    """Write pictures under their published names; their rows of the truth. camera: None for the one on the robot."""
    folder = out / (UP if camera is None else f"{OVERHEAD}/{camera}")
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    suffix = "png" if lab.photo.quality is None else "jpg"
    rows: list[list[object]] = []
    for picture in pictures:
        shutter = picture.shutter
        stamp = unix(lab, shutter.time) + offset
        name = f"{stamp:.6f}.{suffix}"
        if camera is None:
            name = f"up_g{shutter.arrival.goal}_l{shutter.arrival.round}_{name}"
        with writing(folder):
            (folder / name).write_bytes(picture.file)
        ids = " ".join(map(str, picture.ids))
        corners = " ".join(f"{value:.4f}" for value in picture.corners.ravel())
        place = f"{folder.name if camera is None else f'{OVERHEAD}/{camera}'}/{name}"
        rows.append([place, f"{unix(lab, shutter.time):.6f}", shutter.round, shutter.arrival.goal + 1, ids, corners])
    return rows


def _check(record: RunRecord, lab: Lab, out: Path) -> None:
    if record.manifest.scenario_name != lab.scenario:
        raise InputError(
            f"{record.directory}: a run of {record.manifest.scenario_name}, but lab {lab.name} stands in {lab.scenario}"
        )
    goals = len(record.manifest.goals)
    named = [number for camera in lab.cameras for number in camera.waypoints]
    named += [number for bundle in (lab.ceiling.bundles if lab.ceiling else ()) for number in bundle.waypoints]
    if max(named) > goals:
        raise InputError(f"lab {lab.name}: waypoint {max(named)}; the run has waypoints 1 to {goals}")
    if out.is_file() or (out.is_dir() and any(out.iterdir())):
        raise RecordError(f"{out}: exists already; expected the name of a new folder for the lab's pictures")


class _Eye:
    """A camera of the lab: its lens as a table, its shutter, its noise."""

    def __init__(self, camera: Camera, lab: Lab) -> None:
        corners = pixel_corners(camera.width, camera.height)
        self.camera = camera
        self.rays = camera.undistort(corners.reshape(-1, 2)).reshape(corners.shape)
        self.pinhole = covering_pinhole(self.rays)
        self._photo = lab.photo
        self._keys = stream(lab.seed, f"lab/{camera.name}/noise")

    def instants(self, time: float) -> FloatArray:
        """(16,) s, over the time that the shutter is open around `time`."""
        return time + self._photo.shutter * ((np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5)

    def key(self) -> int:
        """The next picture's noise."""
        return int(self._keys.integers(0, 2**64, dtype=np.uint64))

    def development(self, behind: Backdrop) -> Development:
        """How this camera's pictures are developed, exposed for what it sees in `behind`."""
        photo = self._photo
        gain = gain_for(behind.radiance, photo.light, photo.exposure)
        return Development(photo.noise, natural_vignetting(self.rays), gain)

    def softened(self, radiance: Light) -> Light:
        """The whole picture through the point-spread function."""
        height, width = radiance.shape
        return soften(radiance, self._photo.softness, (slice(0, height), slice(0, width)), radiance)

    def corners(self, T_camera_tags: FloatArray, square: FloatArray) -> FloatArray:
        """(4, 2) px of a tag's corners in the middle of the exposure. square: (4, 2) m in the tag's frame."""
        T = 0.5 * (T_camera_tags[SAMPLES // 2 - 1] + T_camera_tags[SAMPLES // 2])
        return self.camera.project(square @ T[:3, :2].T + T[:3, 3])


def _placed(place: Place, height: float) -> FloatArray:
    T = place.pose.matrix()
    T[2, 3] = height
    return T


def _in_bundle(tag: BundleTag) -> FloatArray:
    """Pose of a tag's card in its sheet: x to the sheet's top, y to its left, z out of the paper."""
    return SE2(tag.y, -tag.x, float(np.radians(tag.heading))).matrix()
