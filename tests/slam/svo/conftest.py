import pytest

from taskslam.slam.methods.svo import Svo


@pytest.fixture(scope="session")
def drive(stereo_drive):
    return stereo_drive


@pytest.fixture(scope="session")
def follow(follow_stereo):
    return follow_stereo(Svo)
