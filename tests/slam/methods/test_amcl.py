"""The adapter of the amcl package: a particle filter in a hall whose plan it is given."""

import importlib.util
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from taskslam.errors import InputError, MethodUnavailableError
from taskslam.geometry import SE2
from taskslam.measurements import LaserScan
from taskslam.robot import SensorRig, load_robot
from taskslam.slam.guest.host import MethodHost
from taskslam.slam.methods.amcl import Amcl
from taskslam.world.floor_plan import FREE, OCCUPIED, FloorPlan
from taskslam.world.map_server import save_floor_plan

RIG = load_robot("turtlebot2").rig
RESOLUTION = 0.05
needs_amcl = pytest.mark.skipif(importlib.util.find_spec("amcl") is None, reason="amcl is not installed (extra amcl)")


@pytest.fixture(scope="module")
def walls(drives):
    return np.array(drives.box(0, 0, 9, 7) + drives.box(3, 3, 6, 4) + drives.box(0, 5.2, 0.5, 5.9))


@pytest.fixture(scope="module")
def drive(drives, walls):
    return drives.drive(walls, np.array([(1.5, 1.5), (7.5, 1.5), (7.5, 5.5)]), speed=0.5)


@pytest.fixture(scope="module")
def plan_file(walls, tmp_path_factory):
    """The hall, on a grid that is turned by 30 degrees in its own frame."""
    origin = SE2(3.0, -6.0, np.radians(30))
    cells = np.full((320, 320), FREE, np.uint8)
    plan = FloorPlan(cells, RESOLUTION, origin)
    along = np.linspace(0, 1, 400)[:, None]
    for x0, y0, x1, y1 in walls:
        row, column = plan.cells_of(np.array([x0, y0]) + along * np.array([x1 - x0, y1 - y0])).T
        cells[row, column] = OCCUPIED
    file = tmp_path_factory.mktemp("maps") / "hall.yaml"
    save_floor_plan(plan, file)
    return file


def started(plan_file, **options):
    method = Amcl(map=str(plan_file), **{"start": "1.5,1.5,0", **options})
    method.start(RIG)
    return method


@needs_amcl
def test_it_knows_where_it_is_in_the_given_map(drives, drive, plan_file) -> None:
    done = drives.follow(started(plan_file), drive)
    assert set(done.statuses[1:]) == {"tracking"}
    assert done.errors.mean() < 0.1
    assert done.errors.max() < 0.2


@needs_amcl
def test_behind_the_wall_it_reads_the_map_and_the_image_beside_it(plan_file, tmp_path) -> None:
    with MethodHost("amcl", {"map": str(plan_file), "start": "1.5,1.5,0"}, RIG, tmp_path / "log") as host:
        assert host.card.kind == "localization"


@needs_amcl
def test_a_wrong_guess_of_the_start_is_made_good(drives, drive, plan_file) -> None:
    """By 0.3 m and 5 degrees: the pose is then off by the guess at first, and where it is in the map at the end."""
    done = drives.follow(started(plan_file, start="1.8,1.5,0.087"), drive)
    found, true = SE2(1.8, 1.5, 0.087) @ SE2(*done.estimates[-1]), SE2(1.5, 1.5, 0.0) @ SE2(*done.truth[-1])
    assert found.distance_to(true) < 0.2


@needs_amcl
def test_the_same_input_gives_the_same_answers_in_another_process(plan_file) -> None:
    code = (
        "import sys; sys.path[:0] = sys.argv[1:2]\n"
        "import numpy as np, hashlib, taskslam.slam.methods.amcl as m\n"
        "from taskslam.robot import load_robot; from taskslam.slam.conformance.drive import ConformanceDrive\n"
        "rig = load_robot('turtlebot2').rig\n"
        f"method = m.Amcl(map={str(plan_file)!r}, start=(1.5, 1.5, 0)); method.start(rig)\n"
        "drive = ConformanceDrive(rig, sensors=method.card.sensors)\n"
        "answers = [method.feed(one) for one in drive.measurements(0, 6 * 10**9)]\n"
        "print(hashlib.sha256(b''.join(a.T_start_base.tobytes() for a in answers if a is not None)).hexdigest())"
    )
    said = {
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout for _ in "ab"
    }
    assert len(said) == 1
    assert len(said.pop()) == 65


@needs_amcl
def test_blind_it_rides_on_the_odometry(drives, drive, plan_file) -> None:
    blind = [
        replace(m, ranges=np.full_like(m.ranges, np.inf)) if isinstance(m, LaserScan) and m.stamp > 4e9 else m
        for m in drive.measurements[:600]
    ]
    count = sum(isinstance(m, LaserScan) for m in blind)
    done = drives.follow(started(plan_file), drives.Drive(None, blind, drive.truth[:count]))
    assert done.errors.max() < 0.2


@needs_amcl
def test_particles_that_are_spread_are_lost(drives, drive, plan_file) -> None:
    """In a map of another place, with particles all over it."""
    wide = started(plan_file, start_deviation="3,3,3", lost_deviation=0.5, z_hit=0.01, z_rand=0.99)
    assert "lost" in drives.follow(wide, drive).statuses


def test_its_absence_names_the_extra(plan_file, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "amcl", None)
    with pytest.raises(MethodUnavailableError, match=r"pip install '?\"?taskslam\[amcl\]"):
        started(plan_file)


def test_importing_the_adapter_imports_no_gpl_package() -> None:
    code = "import sys, taskslam.slam.methods.amcl; print('amcl' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"map": None}, "amcl localises in a map that is given: --option map=/maps/plan.yaml"),
        ({"map": "plan.yaml"}, "amcl option map: 'plan.yaml' is not a whole path"),
        ({"map": "/nowhere/plan.yaml"}, "amcl option map: /nowhere/plan.yaml"),
        ({"start": "0,0,0"}, r"amcl option start: \(0, 0\) is not free in"),
        ({"start": "1,2"}, "amcl option start"),
        ({"sigma_hits": 1}, "Did you mean 'sigma_hit'"),
        ({"z_hit": -1}, "amcl option z_hit"),
    ],
)
def test_what_is_wrong_is_named(options, words, plan_file) -> None:
    given = {"map": str(plan_file), "start": "1.5,1.5,0", **options}
    with pytest.raises(InputError, match=words):
        Amcl(**{key: value for key, value in given.items() if value is not None}).start(RIG)


def test_a_robot_without_lidar_is_refused(plan_file) -> None:
    with pytest.raises(InputError, match="amcl needs a 2D LiDAR"):
        Amcl(map=str(plan_file)).start(SensorRig(odometry=RIG.odometry))
