"""What is wrong with this very robot, and no data sheet tells: what is drawn for a run, and what is always off.

Only the simulator sees it (design D12). A method is told the sensor rig (`SensorRig`): what a maker prints. What a file
does not give is not wrong.
"""

from __future__ import annotations

from typing import Annotated, get_args

from pydantic import Field

from taskslam.field_types import NonNegative, Positive
from taskslam.robot.parts import Part, SparsePart


class OdometerImperfections(SparsePart):
    """gyro_bias: standard deviation of the bias that each run draws once, rad/s.

    gyro_turn_on: of the part of it that each reset draws anew, rad/s; gyro_walk: of its random walk, rad/s per square
    root of a second. scale: systematic relative distance error; scale_of_round: standard deviation of what each reset
    adds. slip: relative random distance error per square root of a metre; slip_of_round: standard deviation of a normal
    draw at each reset, whose size is added.
    """

    gyro_bias: NonNegative = 0.0
    scale: float = 0.0
    slip: NonNegative = 0.0
    gyro_turn_on: NonNegative | None = None
    gyro_walk: NonNegative | None = None
    scale_of_round: NonNegative | None = None
    slip_of_round: NonNegative | None = None


class Fitting(SparsePart):
    """How well a sensor is fitted: its mount is measured by a person, and its stamps come from another clock.

    misplaced, misaligned: the most by which x, y, z (m) and roll, pitch, yaw (rad) of its mount are off the data sheet;
    each run draws each of them evenly. late: the most by which all its stamps are too late, s, drawn evenly by each
    run; jitter: the most by which a stamp is later than that, s, drawn evenly for each measurement.
    """

    misplaced: NonNegative | None = None
    misaligned: NonNegative | None = None
    late: Annotated[float, Field(ge=0, le=0.1)] | None = None
    jitter: NonNegative | None = None


class ImuImperfections(Fitting):
    """gyro_bias, accel_bias: standard deviation of each axis' bias, which each run draws once, rad/s and m/s^2.

    gyro_turn_on, gyro_walk: as of the odometry's gyro, for each axis.
    """

    gyro_bias: NonNegative = 0.0
    accel_bias: NonNegative = 0.0
    gyro_turn_on: NonNegative | None = None
    gyro_walk: NonNegative | None = None


class LidarImperfections(Fitting):
    """reach_dark: metres at which a surface that reflects a tenth, met at right angles, is still seen.

    glass_angle: glass is seen by rays within this angle of its normal, rad; the others go through it.
    """

    reach_dark: Positive | None = None
    glass_angle: NonNegative | None = None


class CameraImperfections(Fitting):
    """exposure_lag: time constant with which automatic exposure follows the light, s; 0.25 if not given."""

    exposure_lag: Positive | None = None


class MotorImperfections(Part):
    """lag: time constant with which the wheels follow a command, s.

    deadband: a wheel that is told to be slower than this stands, m/s; track: distance between the wheels, m.
    """

    lag: NonNegative = 0.0
    deadband: NonNegative = 0.0
    track: Positive = 0.23


class CarpetImperfections(Part):
    """Square carpets, laid anew for each run on a grid of cells of `size` metres; a cell bears one with chance `share`.

    scale: by how much more way the wheels count there; drift: the part of the way by which the pile pushes the robot
    in a direction of each carpet's own.
    """

    size: Positive
    share: Annotated[float, Field(ge=0, le=1)]
    scale: float = 0.0
    drift: NonNegative = 0.0


class Imperfections(SparsePart):
    """Of each sensor, of the motors, and of the floor that this robot drives on.

    others: of sensors that other packages register, numbers by name under the sensor's own.
    """

    odometry: OdometerImperfections = OdometerImperfections()
    imu: ImuImperfections = ImuImperfections()
    others: dict[str, dict[str, float]] = Field(default_factory=dict)
    lidar_2d: LidarImperfections | None = None
    lidar_3d: LidarImperfections | None = None
    stereo: CameraImperfections | None = None
    rgbd: CameraImperfections | None = None
    motors: MotorImperfections | None = None
    carpets: CarpetImperfections | None = None

    def fitting(self, part: str) -> Fitting:
        """Of the sensor in the rig's field `part`: perfect where nothing is said."""
        found = getattr(self, part, None)
        return found if isinstance(found, Fitting) else Fitting()

    @classmethod
    def holds(cls, part: str, key: str) -> bool:
        """Whether `key` of the sensor in the rig's field `part` belongs here and not on its data sheet."""
        field = cls.model_fields.get(part)
        kinds = () if field is None else (field.annotation, *get_args(field.annotation))
        return any(isinstance(kind, type) and issubclass(kind, Part) and key in kind.model_fields for kind in kinds)
