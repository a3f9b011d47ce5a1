"""Measurements on another clock."""

from __future__ import annotations

from dataclasses import replace

from taskslam.measurements import ImuSamples, Measurement


def shifted(measurement: Measurement, shift: int) -> Measurement:
    """The same, `shift` ns later."""
    if not shift:
        return measurement
    if isinstance(measurement, ImuSamples):
        return replace(measurement, stamp=measurement.stamp + shift, stamps=measurement.stamps + shift)
    return replace(measurement, stamp=measurement.stamp + shift)
