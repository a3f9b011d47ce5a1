"""The still start: while the robot stands, the accelerometer shows gravity alone and the gyro its bias alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taskslam.geometry import FloatArray

_FASTEST_TURN = 0.1  # rad/s that no bias reaches
_SCATTER = 3.0  # times the noise of the data sheet


@dataclass(frozen=True, slots=True)
class Standstill:
    """gravity: (3,) m/s^2 in the IMU frame, pointing down, of the given length. gyro_bias: (3,) rad/s.

    scale: what the accelerometer must be multiplied with to show that length.
    """

    gravity: FloatArray
    gyro_bias: FloatArray
    scale: float


def standstill(
    rates: FloatArray, forces: FloatArray, gyro_noise: float, accel_noise: float, gravity: float
) -> Standstill | None:
    """What (K, 3) rates (rad/s) and forces (m/s^2) of a standing IMU tell; None where it moved.

    It moved if a mean rate is beyond any bias, or if the samples scatter by three times the noise of the data sheet
    (gyro_noise, accel_noise: standard deviations of one sample) and by more than 0.02 rad/s or 0.2 m/s^2.
    """
    mean_rate, mean_force = rates.mean(axis=0), forces.mean(axis=0)
    moved = (
        float(np.linalg.norm(mean_rate)) > _FASTEST_TURN
        or float(rates.std(axis=0).max()) > max(_SCATTER * gyro_noise, 0.02)
        or float(forces.std(axis=0).max()) > max(_SCATTER * accel_noise, 0.2)
    )
    length = float(np.linalg.norm(mean_force))
    if moved or length < 0.5 * gravity:
        return None
    return Standstill(-mean_force * (gravity / length), mean_rate, gravity / length)
