"""What all our stereo methods refuse in the same way."""

import numpy as np
import pytest

from taskslam.errors import InputError, MethodUnavailableError
from taskslam.measurements import StereoImages
from taskslam.robot import SensorRig
from taskslam.slam.methods.dsol import Dsol
from taskslam.slam.methods.gf_gg import GfGg
from taskslam.slam.methods.msckf import Msckf
from taskslam.slam.methods.stereo_method import StereoMethod
from taskslam.slam.methods.svo import Svo


@pytest.fixture(params=[Dsol, GfGg, Msckf, Svo], ids=lambda kind: kind.card.name)
def kind(request):
    if request.param in (GfGg, Msckf):
        pytest.importorskip("cv2", reason=f"needs the extra `{request.param.card.extra}`")
    return request.param


def test_a_robot_without_cameras_is_refused(kind, rig):
    with pytest.raises(InputError, match=f"{kind.card.name} needs a stereo camera"):
        kind().start(SensorRig(odometry=rig.odometry, imu=rig.imu))


def test_pictures_of_another_size_than_promised_are_refused(kind, rig):
    method = kind()
    method.start(rig)
    right, wrong = np.zeros((480, 752), np.uint8), np.zeros((480, 640), np.uint8)
    for left, other in ((wrong, wrong), (right, wrong), (wrong, right)):
        with pytest.raises(InputError, match=r"expected \(480, 752\)"):
            method.feed(StereoImages(0, left, other))


def test_it_must_be_started(kind):
    with pytest.raises(InputError, match="start before feed"):
        kind().feed(StereoImages(0, np.zeros((480, 752), np.uint8), np.zeros((480, 752), np.uint8)))


def test_a_missing_package_names_the_extra(rig):
    class Lacking(StereoMethod):
        card = GfGg.card
        levels = 1

        def make_tracker(self, camera, R_camera_imu):
            raise ModuleNotFoundError("No module named 'cv2'", name="cv2")

    with pytest.raises(MethodUnavailableError, match=r"pip install '?\"?taskslam\[gf-gg\]"):
        Lacking().start(rig)
