import pytest

from taskslam.slam.methods.dsol import Dsol


@pytest.fixture(scope="session")
def drive(stereo_drive):
    return stereo_drive


@pytest.fixture(scope="session")
def follow(follow_stereo):
    """Runs dsol with these options on the drive, changed."""

    def run(change=lambda measurement, number: measurement, rig=None, **options):
        return follow_stereo(Dsol(**options), change, rig)

    return run
