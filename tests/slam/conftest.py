"""A host for the guests in `guests/`, fed with a robot that stands still; recorded drives."""

import importlib.util
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from taskslam.geometry import SE2
from taskslam.measurements import LaserScan, Measurement, WheelOdometry
from taskslam.robot import SensorRig, load_robot
from taskslam.slam.guest.host import Limits, MethodHost
from taskslam.slam.guest.latency import LatencyModel

sys.path.insert(0, str(Path(__file__).parent))

from stereo_drive import follow_stereo, stereo_drive

__all__ = ["follow_stereo", "stereo_drive"]

MILLISECOND = 1_000_000


@pytest.fixture(scope="session")
def rig() -> SensorRig:
    return load_robot("turtlebot2").rig


@pytest.fixture(scope="session")
def drives() -> ModuleType:
    """The recorded drives of `karto/drives.py`, for every 2D LiDAR method."""
    if "karto_drives" not in sys.modules:
        spec = importlib.util.spec_from_file_location("karto_drives", Path(__file__).parent / "karto" / "drives.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules["karto_drives"] = module
        spec.loader.exec_module(module)
    return sys.modules["karto_drives"]


@pytest.fixture
def guests(monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of guest methods, importable here and in the child."""
    folder = Path(__file__).parent / "guests"
    monkeypatch.syspath_prepend(str(folder))
    return folder


@pytest.fixture
def host_of(guests: Path, rig: SensorRig, tmp_path: Path) -> Iterator[Callable[..., MethodHost]]:
    """Makes hosts of `misbehaving:<name>` or of a registered method, and stops them in the end."""
    hosts: list[MethodHost] = []

    def make(
        name: str, options: dict[str, Any] | None = None, latency: LatencyModel | None = None, **limits: Any
    ) -> MethodHost:
        method = f"misbehaving:{name}" if name[0].isupper() else name
        log = tmp_path / f"method{len(hosts)}.log"
        host = MethodHost(method, options or {}, rig, log, latency, Limits(**{"frame_timeout_s": 1.0, **limits}))
        hosts.append(host)
        return host

    yield make
    for host in hosts:
        host.stop()


@pytest.fixture
def still_robot() -> Callable[[int], Iterator[Measurement]]:
    """Odometry at 50 Hz and a scan at 10 Hz of a robot that stands, up to so many milliseconds."""

    def measurements(until_ms: int) -> Iterator[Measurement]:
        ranges = np.full(64, 2.0, dtype=np.float32)
        for ms in range(0, until_ms + 1, 20):
            yield WheelOdometry(ms * MILLISECOND, SE2(), 0.0, 0.0)
            if ms % 100 == 0:
                yield LaserScan(ms * MILLISECOND, ranges, -1.0, 2.0 / 63, 0.1, 10.0)

    return measurements
