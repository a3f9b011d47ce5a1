"""Trains the vocabulary that ships with `orb_slam3` on images of the built-in worlds.

    pip install opencv-python-headless
    python tools/train_orb_vocabulary.py [--images 120] [--seed 1]

At random places of the free floor of each built-in scenario, the published stereo camera takes a picture in a random
direction; ORB as OpenCV computes it (the same sampling pattern as ORB-SLAM3's) describes it. The same versions give the
same file, byte for byte.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import cv2
import numpy as np
from scipy import ndimage

from taskslam.benchmark.stage import Stage, set_stage
from taskslam.geometry import SE2
from taskslam.observer import Observer
from taskslam.robot import load_robot
from taskslam.scenario import load_scenario
from taskslam.simulation.motion import Motion
from taskslam.simulation.sensors.camera import StereoCameraSensor
from taskslam.slam.orb.vocabulary import save
from taskslam.slam.orb.vocabulary_training import train

SCENARIOS = ("house", "warehouse", "hospital")
CLEARANCE_M = 0.5
FEATURES = 500
DESTINATION = Path(__file__).parents[1] / "src/taskslam/slam/orb/vocabulary.npz"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--images", type=int, default=120, help="in each scenario")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    rng = np.random.default_rng(asked.seed)
    descriptors = []
    for name in SCENARIOS:
        stage = set_stage(load_scenario(name), [], Observer())
        descriptors += pictures(stage, asked.images, asked.seed, rng)
    vocabulary = train(descriptors, asked.seed)
    with DESTINATION.open("wb") as file:
        save(vocabulary, file)
    print(
        f"{len(descriptors)} images, {sum(map(len, descriptors))} descriptors, {len(vocabulary.parent)} nodes,"
        f" {int(vocabulary.is_word.sum())} words, {DESTINATION.stat().st_size / 1e3:.0f} kB"
    )


def pictures(stage: Stage, images: int, seed: int, rng: np.random.Generator) -> list[np.ndarray]:
    """Descriptors of so many images; an image of a bare wall may have none and is left out."""
    stereo = load_robot("turtlebot2").rig.stereo
    assert stereo is not None
    camera = StereoCameraSensor(stereo, stage.world, seed)
    orb = cv2.ORB_create(nfeatures=FEATURES, scaleFactor=1.2, nlevels=8, edgeThreshold=19, fastThreshold=12)
    found = []
    for pose in places(stage, images, rng):
        motion = Motion(0, pose)
        camera.reset(len(found))
        pair = camera.measure(0, motion)
        _, descriptors = orb.detectAndCompute(pair.left, None)
        if descriptors is not None:
            found.append(descriptors)
    return found


def places(stage: Stage, count: int, rng: np.random.Generator) -> list[SE2]:
    """Poses on free floor, `CLEARANCE_M` from anything."""
    plan = stage.plan
    clear = ndimage.distance_transform_edt(plan.cells == 0) * plan.resolution > CLEARANCE_M
    rows, columns = np.nonzero(clear)
    chosen = rng.integers(len(rows), size=count)
    headings = rng.uniform(-math.pi, math.pi, size=count)
    points = plan.points_of(np.column_stack((rows[chosen], columns[chosen])))
    return [SE2(x, y, heading) for (x, y), heading in zip(points.tolist(), headings.tolist(), strict=True)]


if __name__ == "__main__":
    main()
