"""The method `dsol` as a guest: its card, its refusals, and that no pair waits for a compiler."""

import numpy as np
import pytest

from taskslam.errors import InputError
from taskslam.measurements import ImuSamples, LaserScan, Sensor, StereoImages
from taskslam.slam.bundle import photometric, schur
from taskslam.slam.dsol import points
from taskslam.slam.methods.dsol import Dsol
from taskslam.slam.vision import direct_alignment, gradient_selection, patches, pyramid, se3, stereo_matching


def test_the_card_declares_the_gyro_as_optional():
    assert Dsol.card.sensors == (Sensor.STEREO_IMAGES,)
    assert Dsol.card.optional_sensors == (Sensor.IMU,)
    assert Dsol.card.summary.startswith("independent implementation of")
    assert not Dsol.card.can_save_map


def test_pictures_too_small_for_the_pyramid_are_refused(rig):
    small = rig.stereo.model_copy(update={"width": 100, "height": 80})
    with pytest.raises(InputError, match="100 x 80 are too small for 4 levels"):
        Dsol().start(rig.model_copy(update={"stereo": small}))
    Dsol(levels=3).start(rig.model_copy(update={"stereo": small}))


def test_only_pairs_are_answered(rig):
    method = Dsol()
    method.start(rig)
    assert method.feed(LaserScan(0, np.ones(4, np.float32), 0.0, 0.1, 0.1, 10.0)) is None
    assert method.feed(ImuSamples(0, np.zeros(1, np.int64), np.zeros((1, 3)), np.zeros((1, 3)))) is None


def test_nothing_is_compiled_after_the_start(rig):
    """Each kernel knows after the warm-up every type of argument that it meets on the road."""
    method = Dsol()
    method.start(rig)
    rooms = (photometric, schur, points, direct_alignment, gradient_selection, patches, pyramid, se3, stereo_matching)
    kernels = {f.__name__: f for room in rooms for f in vars(room).values() if hasattr(f, "signatures")}
    before = {name: len(kernel.signatures) for name, kernel in kernels.items()}
    tiles = np.random.default_rng(0).integers(0, 256, (60, 120))
    wall = np.kron(tiles, np.ones((8, 8))).astype(np.uint8)
    wall.setflags(write=False)
    for step in range(12):
        views = (wall[:, at : at + 752] for at in (9 * step + 16, 9 * step + 32))
        assert method.feed(StereoImages(step * 33_000_000, *views)).status == "tracking"
    assert {name: len(kernel.signatures) for name, kernel in kernels.items()} == before
