import numpy as np
import pytest

from taskslam.slam.fast_lio2.state import State
from taskslam.slam.inertial.rotations import exp_so3


@pytest.fixture
def state() -> State:
    return State(
        exp_so3(np.array([0.1, -0.2, 0.7])),
        np.array([0.5, -0.3, 0.1]),
        np.array([0.3, 0.0, 0.1]),
        np.full(3, 1e-3),
        np.full(3, 1e-2),
        exp_so3(np.array([0.02, 0.5, -0.03])),
        np.array([0.015, -0.062, 0.4675]),
        np.array([0.2, -0.1, -9.8]),
    )
