from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam import geometry as g

poses = st.builds(g.SE2, st.floats(-100, 100), st.floats(-100, 100), st.floats(-math.pi, math.pi))


def close(a: g.SE2, b: g.SE2) -> bool:
    return bool(np.allclose(a.matrix(), b.matrix(), atol=1e-9))


@given(poses)
def test_a_pose_and_its_inverse_cancel(pose: g.SE2) -> None:
    assert close(pose @ pose.inverse(), g.SE2())


@given(poses, poses, poses)
def test_composition_is_associative(a: g.SE2, b: g.SE2, c: g.SE2) -> None:
    assert close((a @ b) @ c, a @ (b @ c))


@given(poses, poses)
def test_composition_agrees_with_matrices_and_with_rows(a: g.SE2, b: g.SE2) -> None:
    product = a @ b
    assert np.allclose(a.matrix() @ b.matrix(), product.matrix(), atol=1e-9)
    row = g.compose(a.array(), b.array())
    assert close(g.SE2(*row), product)
    assert close(g.SE2(*g.invert(a.array())), a.inverse())


@given(st.floats(-50, 50))
def test_wrapped_angles_lie_in_one_turn_and_point_the_same_way(angle: float) -> None:
    wrapped = g.wrap_angle(angle)
    assert -math.pi <= wrapped <= math.pi
    assert math.isclose(math.cos(wrapped), math.cos(angle), abs_tol=1e-12)
    assert math.isclose(math.sin(wrapped), math.sin(angle), abs_tol=1e-12)


def test_mean_heading_works_across_the_wrap() -> None:
    assert g.mean_heading(np.array([math.pi - 0.1, -math.pi + 0.1])) == pytest.approx(math.pi)


def test_roll_pitch_yaw_follow_the_fixed_axis_convention() -> None:
    R = g.rotation_from_rpy(0.0, 0.0, math.pi / 2)
    assert np.allclose(R @ [1, 0, 0], [0, 1, 0])
    assert np.allclose(g.rotation_from_rpy(0.0, math.pi / 2, 0.0) @ [1, 0, 0], [0, 0, -1])
    combined = g.rotation_from_rpy(0.3, 0.0, 0.0)
    assert np.allclose(g.rotation_from_rpy(0.3, 0.2, 0.1), g.rotation_from_rpy(0, 0.2, 0.1) @ combined)


def test_a_sheared_or_mirrored_matrix_is_not_rigid() -> None:
    T = g.pose_from_xyz_rpy((1, 2, 3), (0.1, 0.2, 0.3))
    assert g.is_rigid(T)
    assert np.allclose(g.invert_se3(T) @ T, np.eye(4))
    assert not g.is_rigid(T * np.array([2, 1, 1, 1]))
    assert not g.is_rigid(np.diag([1.0, 1.0, -1.0, 1.0]))
    assert not g.is_rigid(np.full((4, 4), np.nan))
