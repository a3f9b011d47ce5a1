"""How often is a tag accepted that should not be? Rendered pictures of what goes wrong, judged as a measurement is.

A look is accepted as outside-in does: found once, wholly inside the image, and four corners that fit a square on the
known floor. Accepting is wrong where there is no such tag (wrong family, decoy, mirrored), where the image's border
cuts it, and where the pose is off by more than 10 mm or 2 degrees (blurred, tiny, over-exposed, partly covered). Good
pictures are among them, so that refusing all is no way to pass.

    python benchmarks/tag_false_accepts.py [CASES_PER_KIND]
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from taskslam.geometry import rotation_from_rpy, wrap
from taskslam.lab.image import SAMPLES, Cards, draw, sheet
from taskslam.lab.lens import Backdrop, pixel_corners
from taskslam.realworld.cameras.camera_model import Camera
from taskslam.realworld.fully_visible import MOST_RESIDUAL_PX, why_cut
from taskslam.realworld.tags.detector import Detector
from taskslam.realworld.tags.tag_family import code_cells, family_size
from taskslam.realworld.tags.tag_plane import TagPlane, fit_in_plane, tag_square

CASES = 400
FAMILY = "tag36h11"
SIZE = 0.19
WRONG_M, WRONG_RAD = 0.010, np.radians(2.0)
CAMERA = Camera(
    "overhead", 240, 180, np.array([[790, 0, 119.5], [0, 790, 89.5], [0, 0, 1]]), np.array([0.11, -0.17, 0, 0])
)
_RAYS = CAMERA.undistort(pixel_corners(240, 180).reshape(-1, 2)).reshape(181, 241, 2)


@dataclass
class Case:
    """One picture. pose: x, y (m) and theta (rad) of the tag in the plane; light: gain over a good exposure."""

    cells: np.ndarray
    plane: TagPlane
    pose: np.ndarray
    size: float = SIZE
    softness: float = 0.7
    light: float = 1.0
    cover: tuple[float, float, float] | None = None  # x, y, radius, px, of a disc in front
    cut: bool = False
    there: bool = True


def floor(rng: np.random.Generator, height: float) -> TagPlane:
    """The floor of a camera that looks down, tilted by up to 30 degrees."""
    tilt = rng.uniform(-0.37, 0.37, 2)
    return TagPlane(rotation_from_rpy(tilt[0], tilt[1], 0.0) @ np.array([0.0, 0.0, -1.0]), -height)


def in_view(rng: np.random.Generator, plane: TagPlane, pixel: np.ndarray) -> np.ndarray:
    """A pose of a tag whose middle is seen at a pixel."""
    return np.append(plane.meet(CAMERA.undistort(pixel))[0], rng.uniform(-np.pi, np.pi))


def tag_cells(rng: np.random.Generator) -> np.ndarray:
    """Any tag of the family."""
    return code_cells(FAMILY, int(rng.integers(family_size(FAMILY))))


def middle(rng: np.random.Generator, spread: float = 20.0) -> np.ndarray:
    """A pixel near the image's middle."""
    return np.array([119.5, 89.5]) + rng.uniform(-spread, spread, 2)


def corners_of(case: Case) -> np.ndarray:
    """(4, 2) true corners in the image, px."""
    c, s = np.cos(case.pose[2]), np.sin(case.pose[2])
    flat = tag_square(case.size, from_above=True) @ np.array([[c, s], [-s, c]]) + case.pose[:2]
    T = case.plane.T_camera_plane
    return CAMERA.project(np.column_stack([flat, np.zeros(4)]) @ T[:3, :3].T + T[:3, 3])


def good(rng: np.random.Generator) -> Case:
    """As it should be."""
    plane = floor(rng, 2.5)
    return Case(tag_cells(rng), plane, in_view(rng, plane, middle(rng)))


def cut(rng: np.random.Generator) -> Case:
    """Some of the black square lies outside the image, by half a pixel to twenty."""
    plane = floor(rng, rng.uniform(1.8, 3.0))
    while True:
        edge = rng.integers(4)
        at = rng.uniform([0, 0], [240, 180])
        at[edge % 2] = 0 if edge < 2 else (240, 180)[edge % 2]
        case = Case(tag_cells(rng), plane, in_view(rng, plane, at + rng.uniform(-45, 45, 2)), cut=True)
        corners = corners_of(case)
        outside = -min((corners + 0.5).min(), (np.array([239.5, 179.5]) - corners).min())
        if 0.5 < outside < 20:
            return case


def blurred(rng: np.random.Generator) -> Case:
    """Far out of focus."""
    plane = floor(rng, 2.5)
    return Case(tag_cells(rng), plane, in_view(rng, plane, middle(rng)), softness=rng.uniform(1.5, 8.0))


def tiny(rng: np.random.Generator) -> Case:
    """Sides of 8 to 25 px."""
    plane = floor(rng, 2.5)
    return Case(tag_cells(rng), plane, in_view(rng, plane, middle(rng, 60)), size=rng.uniform(0.025, 0.08))


def over_exposed(rng: np.random.Generator) -> Case:
    """Up to thirty times too much light, and a lens that flares."""
    plane = floor(rng, 2.5)
    light, soft = np.exp(rng.uniform(0.5, 3.4)), rng.uniform(0.7, 2.5)
    return Case(tag_cells(rng), plane, in_view(rng, plane, middle(rng)), light=light, softness=soft)


def wrong_family(rng: np.random.Generator) -> Case:
    """Tags of other families."""
    family = ("tag36h10", "tag25h9")[rng.integers(2)]
    plane = floor(rng, 2.5)
    cells = code_cells(family, int(rng.integers(family_size(family))))
    return Case(cells, plane, in_view(rng, plane, middle(rng)), there=False)


def decoy(rng: np.random.Generator) -> Case:
    """Tag-shaped: random cells in a black border, or a tag with three to eight cells turned."""
    plane = floor(rng, 2.5)
    cells = np.zeros((8, 8), bool)
    if rng.random() < 0.5:
        cells[1:-1, 1:-1] = rng.random((6, 6)) < 0.5
    else:
        inside = tag_cells(rng)[1:-1, 1:-1].copy().ravel()
        turned = rng.choice(36, rng.integers(3, 9), replace=False)
        inside[turned] ^= True
        cells[1:-1, 1:-1] = inside.reshape(6, 6)
    return Case(cells, plane, in_view(rng, plane, middle(rng)), there=False)


def mirrored(rng: np.random.Generator) -> Case:
    """A tag seen in a mirror, or printed from the wrong side."""
    plane = floor(rng, 2.5)
    return Case(tag_cells(rng)[:, ::-1], plane, in_view(rng, plane, middle(rng)), there=False)


def covered(rng: np.random.Generator) -> Case:
    """Something in front of a corner or an edge."""
    plane = floor(rng, 2.5)
    case = Case(tag_cells(rng), plane, in_view(rng, plane, middle(rng)))
    corners = corners_of(case)
    along = rng.uniform(0, 1) * (rng.random() < 0.5)
    at = corners[0] * (1 - along) + corners[1] * along + rng.normal(0, 3, 2)
    case.cover = (float(at[0]), float(at[1]), rng.uniform(2, 14))
    return case


KINDS: dict[str, Callable[[np.random.Generator], Case]] = {
    "good": good,
    "cut by the border": cut,
    "out of focus": blurred,
    "tiny": tiny,
    "over-exposed": over_exposed,
    "wrong family": wrong_family,
    "decoy": decoy,
    "mirrored": mirrored,
    "partly covered": covered,
}


def picture(case: Case, rng: np.random.Generator) -> np.ndarray:
    """What the camera writes, grey values linear in light."""
    c, s, (x, y) = np.cos(case.pose[2]), np.sin(case.pose[2]), case.pose[:2]
    T_plane_tag = np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    poses = np.broadcast_to(case.plane.T_camera_plane @ T_plane_tag, (SAMPLES, 1, 4, 4))
    side = case.size * (len(case.cells) + 2) / len(case.cells)
    cards = Cards(sheet(case.cells)[None], side, np.ascontiguousarray(poses))
    behind = Backdrop(np.full((180, 240), rng.uniform(0.1, 0.6), np.float32), np.full((180, 240), np.inf, np.float32))
    light, _ = draw(behind, _RAYS, 1.0, cards, None)
    if case.cover is not None:
        u, v = np.meshgrid(np.arange(240), np.arange(180))
        near = np.hypot(u - case.cover[0], v - case.cover[1]) < case.cover[2]
        light[near] = rng.uniform(0.02, 0.9)
    grey = 255 * case.light * gaussian_filter(light, case.softness)
    return np.asarray(np.clip(np.rint(grey + rng.normal(0, 2, grey.shape)), 0, 255), dtype=np.uint8)


def judge(case: Case, detector: Detector, rng: np.random.Generator) -> tuple[bool, bool, bool]:
    """Whether anything was found, whether it was accepted, and whether that was wrong."""
    tags = detector.detect(picture(case, rng))
    accepted = wrong = False
    for tag in tags if len(tags) == 1 else []:
        if why_cut(tag.corners, CAMERA, FAMILY) is not None:
            continue
        fit = fit_in_plane(
            CAMERA.undistort(tag.corners)[None], tag_square(case.size, from_above=True), case.plane, CAMERA.K[0, 0]
        )
        if not fit.residual_px[0] < MOST_RESIDUAL_PX:
            continue
        accepted = True
        off = np.hypot(*(fit.poses[0, :2] - case.pose[:2]))
        turned = abs(float(wrap(fit.poses[0, 2] - case.pose[2])))
        wrong = case.cut or not case.there or off > WRONG_M or turned > WRONG_RAD
    return bool(tags), accepted, wrong


def count(cases: int, seed: int = 0) -> dict[str, tuple[int, int, int]]:
    """Found, accepted and wrongly accepted pictures of each kind."""
    out = {}
    with Detector(FAMILY) as detector:
        for number, (kind, make) in enumerate(KINDS.items()):
            rng = np.random.default_rng([seed, number])
            judged = np.array([judge(make(rng), detector, rng) for _ in range(cases)])
            found, accepted, wrong = judged.sum(0).tolist()
            out[kind] = (found, accepted, wrong)
    return out


def main(cases: int = CASES) -> None:
    print(
        f"{cases} rendered pictures of each kind, {FAMILY}, maxhamming 1, any id; 240 x 180 px, f 790 px, tag {SIZE} m"
    )
    print(f"{'':<20}{'found':>8}{'accepted':>10}{'wrongly':>9}")
    counted = count(cases)
    for kind, numbers in counted.items():
        print(f"{kind:<20}{numbers[0]:>8}{numbers[1]:>10}{numbers[2]:>9}")
    wrong = sum(numbers[2] for numbers in counted.values())
    print(f"accepted wrongly: {wrong} of {cases * len(KINDS)}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
