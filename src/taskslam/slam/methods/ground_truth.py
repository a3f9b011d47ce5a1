"""The truth itself as a method: what remains is what navigation and control add."""

from __future__ import annotations

from taskslam.measurements import Measurement, Sensor, TruePose
from taskslam.robot import SensorRig
from taskslam.slam.base import Kind, MethodCard, PoseEstimate, SlamMethod, Status
from taskslam.version import __version__


class GroundTruth(SlamMethod):
    """Repeats the true pose. Its card says `reference`, the only kind of method that is ever told."""

    card = MethodCard(
        name="ground_truth",
        version=__version__,
        licence="Apache-2.0",
        kind=Kind.REFERENCE,
        sensors=(Sensor.TRUE_POSE,),
        latency=0.0,
        summary="The true pose: shows how much of the error is navigation and control, not SLAM.",
    )

    def start(self, rig: SensorRig) -> None:
        """Nothing to prepare."""

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """Answer each true pose with itself."""
        if not isinstance(measurement, TruePose):
            return None
        return PoseEstimate(measurement.stamp, measurement.T_start_base.matrix(), Status.TRACKING)
