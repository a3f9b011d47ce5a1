from dataclasses import dataclass

from taskslam.measurements import Measurement, Sensor
from taskslam.robot import Part
from taskslam.sensors import SensorKind


@dataclass(frozen=True, slots=True)
class WallDistance(Measurement):
    """Metres to what stands straight ahead; +inf beyond the range."""

    sensor = Sensor("wall_distance")
    distance: float


class WallRanger(Part):
    """rate: Hz; height: m; noise: standard deviation, m."""

    rate: float
    height: float
    range_max: float
    noise: float


KIND = SensorKind(
    measurement=WallDistance,
    words="wall ranger",
    part=WallRanger,
    field="wall_distance",
    marker="planar",
    device="wall_ranger_device:Device",
)
