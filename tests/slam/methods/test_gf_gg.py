"""The method `gf_gg` as a guest: its card, its refusals, and that no pair waits for a compiler."""

import numpy as np
import pytest

from taskslam.errors import InputError
from taskslam.geometry import SE2
from taskslam.measurements import LaserScan, Sensor, StereoImages, WheelOdometry
from taskslam.slam.bundle import stereo_adjustment, stereo_pose, stereo_residuals, three_point_pose
from taskslam.slam.gf_gg import frame, good_features, good_graph, keyframe_map, local_mapping, places, search
from taskslam.slam.gf_gg import triangulation as triangulating
from taskslam.slam.methods.gf_gg import GfGg
from taskslam.slam.orb import bag_of_words
from taskslam.slam.vision import binary_words, orb_features, pyramid, se3, stereo_matching

pytest.importorskip("cv2", reason="needs the extra `gf-gg`")
ROOMS = (
    *(stereo_adjustment, stereo_pose, stereo_residuals, three_point_pose, frame, good_features, good_graph),
    *(keyframe_map, local_mapping, places, search, triangulating, bag_of_words, binary_words, orb_features, pyramid),
    *(se3, stereo_matching),
)


def test_the_card_declares_the_wheels_as_optional():
    assert GfGg.card.sensors == (Sensor.STEREO_IMAGES,)
    assert GfGg.card.optional_sensors == (Sensor.WHEEL_ODOMETRY,)
    assert GfGg.card.summary.startswith("independent implementation of")
    assert GfGg.card.map_mode == "continue"


def test_pictures_too_small_are_refused(rig):
    small = rig.stereo.model_copy(update={"width": 160, "height": 100})
    with pytest.raises(InputError, match="160 x 100 are too small"):
        GfGg().start(rig.model_copy(update={"stereo": small}))


def test_only_pairs_are_answered(rig):
    method = GfGg(odometry_prior=True)
    method.start(rig)
    assert method.feed(LaserScan(0, np.ones(4, np.float32), 0.0, 0.1, 0.1, 10.0)) is None
    assert method.feed(WheelOdometry(0, SE2(), 0.0, 0.0)) is None


def tiled_wall():
    tiles = np.random.default_rng(0).integers(0, 256, (60, 160))
    wall = np.kron(tiles, np.ones((8, 8))).astype(np.uint8)
    wall.setflags(write=False)
    return wall


@pytest.mark.parametrize("options", [{}, {"good_features": False, "good_graph": False}])
def test_nothing_is_compiled_after_the_start(rig, options):
    """Each kernel knows after the warm-up every type of argument that it meets on the road."""
    method = GfGg(full_frames=3, graph_threshold=2, features_wanted=50, keyframe_ratio=1.0, keyframe_gap=1, **options)
    method.start(rig)
    kernels = {f.__name__: f for room in ROOMS for f in vars(room).values() if hasattr(f, "signatures")}
    assert len(kernels) > 30
    before = {name: len(kernel.signatures) for name, kernel in kernels.items()}
    wall = tiled_wall()
    steps = [*range(20), None, None, 2]
    for n, step in enumerate(steps):
        dark = step is None
        views = [
            np.zeros((480, 752), np.uint8) if dark else wall[:, at : at + 752]
            for at in (9 * (step or 0) + d for d in (0, 16))
        ]
        answer = method.feed(StereoImages(n * 200_000_000, *views))
        assert answer.status == "tracking" or dark
    assert {name: len(kernel.signatures) for name, kernel in kernels.items()} == before
