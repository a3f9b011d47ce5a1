import pytest

from taskslam.world import World
from taskslam.world.builtin.house import build_house


@pytest.fixture(scope="session")
def house() -> World:
    return build_house()
