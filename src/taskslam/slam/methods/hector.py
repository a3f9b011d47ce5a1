"""`hector`: scan-to-map SLAM with a 2D LiDAR and nothing else, our own implementation of Kohlbrecher et al. 2011.

Every scan is aligned by Gauss-Newton with an occupancy grid of several resolutions, from coarse to fine; the map takes
a scan in after 0.4 m or 0.06 rad. No odometry, no loop closure, no pose graph: what the map has taken in stays.
Parameters and defaults: `slam/hector/settings.py`; when it is `lost`: `slam/hector/mapper.py`.

Where it differs from hector_mapping as the benchmark ran it, and why:

- An alignment begins where the motion between the last two scans leads. The published runs took odometry over tf for
  that (protocol 1.3), which this method does not get. The paper begins at the last pose (`predict_motion` False), which
  suits scans at 40 Hz: at the 10 Hz of this robot's LiDAR, turns above 1 rad/s are lost, in the AWS small house always
  the one to the last waypoint.
- A scan that does not lie on the map is not taken into it (`slam/hector/mapper.py`): one scan at a wrong pose and the
  next ones agree with it.
- The map grows with what is seen, up to the published 4096 x 4096 cells; whole, they would take 170 MB.
- The covariance is the Hessian's inverse times the variance of the residuals, and the Hessian gets the
  information of one metre and one radian, so that a bare corridor leaves the pose along it where it was.
- Log-odds stay within 50 on both sides; the original bounds the occupied side.

Its limits: along bare walls nothing tells the way, and it does not notice (in the corridors of TSRB it slips by a
metre, which a map without loops never takes back); a rolling scan is taken as an instant.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from taskslam.errors import InputError
from taskslam.geometry import SE2
from taskslam.measurements import LaserScan, Measurement, Sensor
from taskslam.robot import SensorRig
from taskslam.slam.base import Kind, MapMode, MethodCard, PoseEstimate, SlamMethod
from taskslam.slam.hector.settings import HectorSettings
from taskslam.slam.needs import need_lidar_2d
from taskslam.slam.option_settings import read_options

if TYPE_CHECKING:
    from taskslam.slam.hector.mapper import HectorMapper


class Hector(SlamMethod):
    """2D LiDAR SLAM without odometry. Options: the fields of `HectorSettings`."""

    card: ClassVar[MethodCard] = MethodCard(
        name="hector",
        version="1.0",
        licence="Apache-2.0",
        kind=Kind.SLAM,
        sensors=(Sensor.LASER_SCAN,),
        summary="2D LiDAR scan-to-map alignment on multi-resolution grids; no odometry, no loop closure",
        odometry_prior=False,
        map_mode=MapMode.CONTINUE,
        can_save_map=True,
        deterministic=True,
        latency=0.01,
        queue=1,
    )

    def __init__(self, **options: object) -> None:
        self._settings = read_options(HectorSettings, "hector", options)
        self._mapper: HectorMapper | None = None

    def start(self, rig: SensorRig) -> None:
        """Begin with an empty map. Raises InputError if the robot has no 2D LiDAR."""
        lidar = need_lidar_2d("hector", rig)
        self._T_base_laser = lidar.mount.matrix()
        from taskslam.slam.hector.mapper import HectorMapper, warm_up  # numba comes with it: not to read a card

        warm_up(self._settings)
        self._mapper = HectorMapper(self._settings)

    def feed(self, measurement: Measurement) -> PoseEstimate | None:
        """A live pose for every scan; None for anything else."""
        if not isinstance(measurement, LaserScan):
            return None
        from taskslam.slam.karto.scan_points import scan_to_points

        mapper = self._started()
        scan = scan_to_points(measurement, self._T_base_laser, self._settings.laser_max_dist)
        outcome = mapper.process(scan, measurement.stamp)
        return PoseEstimate(measurement.stamp, SE2(*outcome.pose).matrix(), outcome.status, outcome.covariance)

    def save_map(self, path: Path) -> None:
        """Write the levels of the map to one npz file."""
        from taskslam.slam.hector.map_file import write_map

        write_map(Path(path), self._started(), self._settings)

    def load_map(self, path: Path) -> None:
        """Continue a saved map with the robot at the map's start pose; the settings stay those of this method."""
        from taskslam.slam.hector.map_file import read_map

        mapper = type(self._started())(self._settings)
        read_map(Path(path), mapper)
        self._mapper = mapper

    def _started(self) -> HectorMapper:
        if self._mapper is None:
            raise InputError("hector: call start before feed, save_map or load_map")
        return self._mapper
