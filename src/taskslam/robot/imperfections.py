"""What is wrong with this very robot, and no data sheet tells: what is drawn for a run, and what is always off.

Only the simulator sees it (design D12). A method is told the sensor rig (`SensorRig`): what a maker prints.
"""

from __future__ import annotations

from pydantic import Field

from taskslam.field_types import NonNegative
from taskslam.robot.parts import Part


class OdometerImperfections(Part):
    """gyro_bias: standard deviation of the bias that each run draws once, rad/s.

    scale: systematic relative distance error; slip: relative random distance error per square root of a metre.
    """

    gyro_bias: NonNegative = 0.0
    scale: float = 0.0
    slip: NonNegative = 0.0


class ImuImperfections(Part):
    """gyro_bias, accel_bias: standard deviation of each axis' bias, which each run draws once, rad/s and m/s^2."""

    gyro_bias: NonNegative = 0.0
    accel_bias: NonNegative = 0.0


class Imperfections(Part):
    """Of each sensor. others: of sensors that other packages register, numbers by name under the sensor's own."""

    odometry: OdometerImperfections = OdometerImperfections()
    imu: ImuImperfections = ImuImperfections()
    others: dict[str, dict[str, float]] = Field(default_factory=dict)

    @classmethod
    def holds(cls, part: str, key: str) -> bool:
        """Whether `key` of the sensor in the rig's field `part` belongs here and not on its data sheet."""
        field = cls.model_fields.get(part)
        kind = field.annotation if field is not None else None
        return isinstance(kind, type) and issubclass(kind, Part) and key in kind.model_fields
