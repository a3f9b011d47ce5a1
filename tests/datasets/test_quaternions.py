import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from taskslam.datasets.quaternions import heading, planar_quaternion, pose_of
from taskslam.geometry import is_rigid

angles = st.floats(-math.pi, math.pi).filter(lambda angle: angle == 0 or abs(angle) > 1e-300)  # halves of less are lost


@given(angles)
def test_a_heading_survives_its_quaternion_bit_for_bit(theta):
    z, w = planar_quaternion(theta)
    assert heading(z, w) == theta
    assert math.isclose(math.hypot(z, w), 1.0, abs_tol=1e-14)


@given(angles)
def test_both_signs_of_a_quaternion_are_one_heading(theta):
    z, w = planar_quaternion(theta)
    assert math.isclose(math.cos(heading(-z, -w) - theta), 1.0, abs_tol=1e-12)


def test_a_pose_in_space_is_that_of_the_rotation():
    half = math.radians(30)
    T = pose_of((1.0, 2.0, 3.0), (math.sin(half), 0.0, 0.0, math.cos(half)))
    assert T is not None
    assert is_rigid(T)
    assert np.allclose(T[:3, :3] @ [0, 1, 0], [0, math.cos(2 * half), math.sin(2 * half)])
    assert T[:3, 3].tolist() == [1.0, 2.0, 3.0]


def test_what_is_no_unit_quaternion_is_no_pose():
    assert pose_of((0, 0, 0), (0, 0, 0, 0)) is None
    assert pose_of((0, 0, 0), (1, 1, 0, 0)) is None
    assert pose_of((math.nan, 0, 0), (0, 0, 0, 1)) is None
