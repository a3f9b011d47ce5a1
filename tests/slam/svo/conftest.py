import pytest

from taskslam.slam.methods.svo import Svo


@pytest.fixture(scope="session")
def drive(stereo_drive):
    return stereo_drive


@pytest.fixture(scope="session")
def follow(follow_stereo):
    """Runs svo with these options on the drive, changed."""

    def run(change=lambda measurement, number: measurement, rig=None, **options):
        return follow_stereo(Svo(**options), change, rig)

    return run
