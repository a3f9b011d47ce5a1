import pytest

from taskslam.slam.methods.msckf import Msckf

pytest.importorskip("cv2", reason="needs the extra `msckf`")


@pytest.fixture(scope="session")
def drive(stereo_drive):
    return stereo_drive


@pytest.fixture(scope="session")
def follow(follow_stereo):
    return follow_stereo(Msckf)
