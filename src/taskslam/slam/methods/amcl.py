"""`amcl`: the adapter of the amcl package, Nav2's default localizer: a particle filter in a map that is given.

It makes no map: `--option map=/maps/plan.yaml` names one in the format of ROS's map_server, by its whole path, and
`--option start=x,y,theta` where in it the robot stands at first, as Nav2's map server and `initial_pose` do. Adaptive
Monte Carlo localisation: Fox 2001, NIPS, "KLD-sampling"; sensor model: Thrun, Burgard and Fox 2005, "Probabilistic
Robotics", table 6.3.

The package is the filter alone. What Nav2's node does around it is done here: rays that missed get the greatest range,
which the sensor model leaves out; the filter is updated once the robot has moved by `update_min_d` or turned by
`update_min_a`; between two updates the pose follows the odometry.

Its random numbers are those of the C library (drand48), which begin alike in every process, so a run repeats. With the
recovery rates above zero (Nav2's default is zero) particles are also drawn all over the map.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, field_validator

from taskslam.errors import FloorPlanError, InputError
from taskslam.field_types import Fraction, NonNegative, Positive
from taskslam.geometry import SE2, FloatArray
from taskslam.measurements import LaserScan, Measurement, Sensor, WheelOdometry
from taskslam.robot import SensorRig
from taskslam.slam.base import Kind, MethodCard, PoseEstimate, SlamMethod, Status
from taskslam.slam.karto.odometry_history import OdometryHistory
from taskslam.slam.needs import need_lidar_2d
from taskslam.slam.option_settings import read_options
from taskslam.slam.registry import unavailable

if TYPE_CHECKING:
    from taskslam.world.floor_plan import FloorPlan

_Three = tuple[float, float, float]


class AmclSettings(BaseModel):
    """Options of `amcl`: names and defaults of Nav2's parameters (docs.nav2.org, "AMCL"); metres and radians.

    map: a map_server YAML, by its whole path. start: x, y, theta of the robot in it. start_deviation: of these.
    lost_deviation: m; where the particles spread further than this, the robot is `lost`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    map: Path
    start: _Three = (0.0, 0.0, 0.0)
    start_deviation: _Three = (0.5, 0.5, math.pi / 12)
    lost_deviation: Positive = 1.0
    min_particles: Annotated[int, Field(ge=1)] = 500
    max_particles: Annotated[int, Field(ge=1)] = 2000
    alpha1: NonNegative = 0.2
    alpha2: NonNegative = 0.2
    alpha3: NonNegative = 0.2
    alpha4: NonNegative = 0.2
    alpha5: NonNegative = 0.2
    update_min_d: NonNegative = 0.25
    update_min_a: NonNegative = 0.2
    max_beams: Annotated[int, Field(ge=2)] = 60
    z_hit: Fraction = 0.5
    z_short: Fraction = 0.05
    z_max: Fraction = 0.05
    z_rand: Fraction = 0.5
    sigma_hit: Positive = 0.2
    lambda_short: Positive = 0.1
    recovery_alpha_slow: NonNegative = 0.0
    recovery_alpha_fast: NonNegative = 0.0

    @field_validator("start", "start_deviation", mode="before")
    @classmethod
    def _three(cls, value: object) -> object:
        return value.split(",") if isinstance(value, str) else value


class Amcl(SlamMethod):
    """Monte Carlo localisation with a 2D LiDAR. Options: the fields of `AmclSettings`; `map` must be given."""

    card: ClassVar[MethodCard] = MethodCard(
        name="amcl",
        version="0.1",
        licence="GPL-3.0",
        kind=Kind.LOCALIZATION,
        sensors=(Sensor.LASER_SCAN, Sensor.WHEEL_ODOMETRY),
        summary="Nav2's particle filter in a given map (--option map=/maps/plan.yaml). Makes no map of its own",
        odometry_prior=True,
        deterministic=True,
        latency=0.05,
        queue=1,
        homepage="https://github.com/damanikjosh/amcl_python",
        extra="amcl",
    )

    def __init__(self, **options: object) -> None:
        if "map" not in options:
            raise InputError("amcl localises in a map that is given: --option map=/maps/plan.yaml, a map_server YAML")
        self._settings = read_options(AmclSettings, self.card.name, options)
        if not self._settings.map.is_absolute():
            raise InputError(
                f"amcl option map: '{self._settings.map}' is not a whole path; expected one such as /maps/plan.yaml"
            )
        self._filter: Any = None

    def start(self, rig: SensorRig) -> None:
        """Spread the particles around `start`.

        Raises:
            MethodUnavailableError: the amcl package is not installed; names the extra.
            InputError: the robot has no 2D LiDAR; the map cannot be read, or `start` is not free in it.
        """
        lidar = need_lidar_2d("amcl", rig)
        settings = self._settings
        plan = _plan(settings)
        try:
            import amcl as package
        except ModuleNotFoundError as error:
            raise unavailable(self.card.name, self.card, error) from error
        self._package = package
        self._filter = package.AMCL(
            settings.min_particles,
            settings.max_particles,
            settings.recovery_alpha_slow,
            settings.recovery_alpha_fast,
            package.MotionParameters(*(getattr(settings, f"alpha{n}") for n in range(1, 6))),
            package.LaserParameters(
                settings.z_hit,
                settings.z_short,
                settings.z_max,
                settings.z_rand,
                settings.sigma_hit,
                settings.lambda_short,
                0.0,
                settings.max_beams,
            ),
            "differential",
        )
        # The package's grids have no heading: the map's own frame is the filter's.
        self._T_grid_start = plan.origin.inverse() @ SE2(*settings.start)
        self._filter.set_map(package.create_occupancy_grid_from_list(_cells(plan), plan.resolution, 0.0, 0.0))
        mount = SE2.from_matrix(lidar.mount.matrix())
        self._filter.set_laser_pose(self._vector(mount))
        variances = np.square(settings.start_deviation)
        self._filter.set_initial_pose(
            self._vector(self._T_grid_start), package.create_diagonal_covariance(*map(float, variances))
        )
        self._odometry = OdometryHistory()
        self._updated: SE2 | None = None  # the odometry at the last update
        self._T_grid_odom = SE2()
        self._covariance: FloatArray | None = None

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """A live pose for every scan; None for odometry."""
        if isinstance(measurement, WheelOdometry):
            self._odometry.add(measurement)
            return None
        if not isinstance(measurement, LaserScan):
            return None
        if not len(self._odometry):
            return PoseEstimate(measurement.stamp, np.eye(4), Status.STARTING)
        T_odom_base = self._odometry.at(measurement.stamp)
        if self._moved(T_odom_base):
            self._update(measurement, T_odom_base)
        T_start_base = self._T_grid_start.inverse() @ self._T_grid_odom @ T_odom_base
        return PoseEstimate(measurement.stamp, T_start_base.matrix(), self._status(), self._covariance)

    def _moved(self, T_odom_base: SE2) -> bool:
        if self._updated is None:
            return True
        step = self._updated.inverse() @ T_odom_base
        far = math.hypot(step.x, step.y) >= self._settings.update_min_d
        return far or abs(step.theta) >= self._settings.update_min_a

    def _update(self, scan: LaserScan, T_odom_base: SE2) -> None:
        hits = scan.hits()
        if not hits.any():
            return  # nothing can be told from it, and all particles would count alike
        ranges = np.where(hits, scan.ranges, scan.range_max).astype(np.float64)
        beams = np.column_stack([ranges, scan.angles()]).tolist()
        self._filter.update(
            self._package.create_laser_scan_from_list(beams, float(scan.range_max)), self._vector(T_odom_base)
        )
        mean, spread = self._filter.get_pose_mean(), np.array(self._filter.get_pose_covariance().to_list())
        self._updated = T_odom_base
        self._T_grid_odom = SE2(mean.x, mean.y, mean.theta) @ T_odom_base.inverse()
        turn = self._T_grid_start.inverse().matrix()[:2, :2]
        spread[:2, :2] = turn @ spread[:2, :2] @ turn.T
        self._covariance = spread if np.isfinite(spread).all() else None

    def _status(self) -> Status:
        if self._covariance is None:
            return Status.STARTING
        largest = math.sqrt(max(0.0, float(np.linalg.eigvalsh(self._covariance[:2, :2])[-1])))
        return Status.LOST if largest > self._settings.lost_deviation else Status.TRACKING

    def _vector(self, pose: SE2) -> Any:
        return self._package.Vector3D(float(pose.x), float(pose.y), float(pose.theta))


def _plan(settings: AmclSettings) -> FloorPlan:
    from taskslam.world.floor_plan import FREE
    from taskslam.world.map_server import load_floor_plan

    try:
        plan = load_floor_plan(settings.map)
    except FloorPlanError as error:
        raise InputError(f"amcl option map: {error}") from error
    if plan.at(*settings.start[:2]) != FREE:
        x, y = settings.start[:2]
        raise InputError(
            f"amcl option start: ({x:g}, {y:g}) is not free in {settings.map}; expected where the robot stands"
        )
    return plan


def _cells(plan: FloorPlan) -> list[list[int]]:
    """Rows from the lowest y, in the values of nav_msgs/OccupancyGrid, which are a plan's but for what is unknown."""
    from taskslam.world.floor_plan import UNKNOWN

    cells: list[list[int]] = np.where(plan.cells == UNKNOWN, -1, plan.cells.astype(np.int64)).tolist()
    return cells
