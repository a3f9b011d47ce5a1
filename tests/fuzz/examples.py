"""Small whole files of every kind that the package reads, made by its own writers or a few lines long."""

from __future__ import annotations

import io
import json
import os
from collections.abc import Callable
from dataclasses import asdict
from importlib import resources
from pathlib import Path

import numpy as np
import trimesh
import yaml
from PIL import Image

from taskslam.benchmark.campaign.campaign_file import Campaign
from taskslam.benchmark.campaign.notes import keep
from taskslam.benchmark.campaign.plan_file import write_plan
from taskslam.benchmark.campaign.planning import Plan
from taskslam.benchmark.conformance_eyes import conformance_world
from taskslam.benchmark.engine import Ending, Result
from taskslam.benchmark.spec import spec_of_tour
from taskslam.datasets.bag_writer import BagWriter
from taskslam.datasets.euroc_writer import EUROC_SENSORS, EurocWriter
from taskslam.evaluation import evaluate_runs, write_metrics
from taskslam.geometry import SE2
from taskslam.measurements import (
    ImuSamples,
    LaserScan,
    Measurement,
    PointCloud,
    RgbdImages,
    StereoImages,
    WheelOdometry,
)
from taskslam.mode import Mode
from taskslam.outcomes import Outcome
from taskslam.realworld.cameras.camera_files import save_camera
from taskslam.realworld.cameras.camera_model import Camera
from taskslam.realworld.measured_file import ArrivalRow, MeasuredFile, PlaneRow, dump_measured
from taskslam.record import (
    Arrival,
    GoalFailed,
    GoalSkipped,
    GoalStarted,
    MethodNotice,
    RoundEnded,
    RoundStarted,
    RunEnded,
    RunWriter,
)
from taskslam.record.compression import compress_trajectories
from taskslam.record.journal import JournalWriter
from taskslam.record.resumption import Tally, add_tally
from taskslam.record.served import Served, ServedRecord
from taskslam.record.trajectories import SpatialTrajectory, write_trajectory
from taskslam.robot import Robot, load_robot
from taskslam.scenario import load_scenario
from taskslam.simulation.rendering.prepared_world import prepare
from taskslam.simulation.rendering.scene_cache import save_prepared
from taskslam.slam.cards import card_of
from taskslam.slam.hector.mapper import HectorMapper
from taskslam.slam.hector.settings import HectorSettings
from taskslam.slam.map_archive import write_archive
from taskslam.world import FloorPlan
from taskslam.world.cache import save_cached
from taskslam.world.gazebo.importer import import_sdf
from taskslam.world.gazebo.resources import Resources, search_roots
from taskslam.world.map_server import save_floor_plan
from watched import write_watched

SECOND = 1_000_000_000
GOALS = [SE2(1.0, 2.0, 0.5), SE2(3.0, 0.0, 0.0), SE2(3.0, 4.0, -1.0)]


def put(folder: Path, files: dict[str, str | bytes]) -> None:
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)


def shipped(package: str, kind: str, *names: str) -> Callable[[Path], None]:
    """Files that ship with the package."""

    def write(folder: Path) -> None:
        source = resources.files(package) / kind
        put(folder, {f"{name}.yaml": (source / f"{name}.yaml").read_bytes() for name in names})

    return write


def scenarios(folder: Path) -> None:
    put(
        folder,
        {
            "scenario.yaml": "name: tour\nworld: {name: house}\nfloor_plan: {slice_low: 0.02, resolution: 0.05}\n"
            "robot: turtlebot2\nstart: {x: 0.5, y: 1, theta: 0.1}\nprotocol: {rounds: 3, pause: 2.5}\n"
            "sequence:\n  waypoints: [[1.0, 2.0, 0.5], [3, 0, 0]]\n  path: [0, 1, 0]\n",
            "files.yaml": "name: tour\nfloor_plan: {map: plan.yaml}\nstart: {x: 0.5, y: 1, theta: 0.1}\n"
            "sequence: {waypoints_file: waypoints.txt, path_file: path.txt}\n",
            "goals.yaml": "name: tour\nworld: {name: house}\nstart: {x: 0.5, y: 1, yaw: 0.1}\n"
            "sequence: {waypoints_file: list.yaml}\n",
            "list.yaml": "waypoints:\n- {x: 1.0, y: 2.0, yaw: 0.5}\n- [3, 0, 0]\n",
            "waypoints.txt": "# index x y theta\n0 1.0 2.0 0.5\n1 3.0 0.0 0.0\n2 3.0 4.0 -1.0\n",
            "path.txt": "0\n1\n2 # the last\n",
        },
    )


def study(folder: Path) -> None:
    trajectories(folder)
    put(
        folder,
        {
            "study.yaml": "sequences:\n  one:\n    groundtruth: run.tum\n    frames: 40\n    runs:\n"
            "      a: [run.tum, other.tum]\n      b: '*.csv'\nmethods:\n  a: {align: yaw}\n"
            "units: {robot_diameter: 0.30, field_of_view: 70}\n"
        },
    )


def setups(folder: Path) -> None:
    common = "runs: [{arrivals: log.csv, method: karto, mode: without-map}]\nwaypoints: [[1, 2, 0], [3, 4, 90]]\n"
    camera = "name: east, images: east, calibration: east.yaml, image_kind: raw"
    put(
        folder,
        {
            "outside.yaml": f"{common}tag: {{id: 5, size: 0.19}}\ncameras: [{{{camera}, waypoints: [1, 2]}}]\n",
            "inside.yaml": f"{common}camera: {{{camera}, clock_offset: estimate}}\n"
            "bundles: [{waypoints: [1], square: {ids: [1, 2, 3, 4], size: 0.15, spacing: 0.6}}]\n",
        },
    )


def arrivals(folder: Path) -> None:
    put(
        folder,
        {
            "log.csv": "time,round,waypoint\n1700000010.5,1,1\n2023-11-14T22:13:50Z,1,2\n1700000100.25,2,1\n",
            "log.txt": "# timestamp x y theta\n1700000010.500000 1.000000 2.000000 0.500000\n"
            "1700000020.5 3.0 0.0 0.0\n1700000100.5 1.0 2.0 0.5\n",
            "indexed.txt": "1700000010.5 1.0 2.0 0.5 0 0\n1700000020.5 3.0 0.0 0.0 1 0\n1700000100.5 1.0 2.0 0.5 0 1\n",
            "planned_waypoints.txt": "1.0 2.0 0.5\n3.0 0.0 0.0\n3.0 4.0 -1.0\n",
        },
    )


def cameras(folder: Path) -> None:
    K = np.array([[300.0, 0, 160], [0, 300.0, 120], [0, 0, 1]])
    save_camera(folder / "ros.yaml", Camera("east", 320, 240, K, np.array([0.1, -0.2, 0.001, 0.002, 0.0])))
    one = {
        "camera_model": "pinhole", "intrinsics": [300.0, 300.0, 160.0, 120.0], "resolution": [320, 240],
        "distortion_model": "radtan", "distortion_coeffs": [0.1, -0.2, 0.001, 0.002],
    }  # fmt: skip
    turned = np.eye(4)
    turned[0, 3] = 0.1
    put(folder, {"kalibr.yaml": yaml.safe_dump({"cam0": one, "cam1": {**one, "T_cn_cnm1": turned.tolist()}})})


def floor_plans(folder: Path) -> None:
    cells = np.random.default_rng(0).choice(np.array([0, 100, 255], np.uint8), (12, 17))
    plan = FloorPlan(cells, 0.05, SE2(-1.0, -2.0, 0.0))
    save_floor_plan(plan, folder / "grey.yaml", "pgm")
    save_floor_plan(plan, folder / "colour.yaml", "png")
    put(
        folder,
        {
            "plain.pgm": "P2\n# by hand\n4 3\n255\n0 254 205 0\n1 2 3 4\n5 6 7 255\n",
            "plain.yaml": "image: plain.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nmode: scale\nnegate: 1\n",
            "alpha.yaml": "image: alpha.png\nresolution: 0.1\norigin: [0, 0, 0]\nmode: scale\n",
            "alpha.png": encoded("PNG", "RGBA"),
            "deep.yaml": "image: deep.png\nresolution: 0.1\norigin: [0, 0, 0]\nmode: raw\n",
            "deep.png": encoded("PNG", "I;16"),
        },
    )


def picture(mode: str) -> Image.Image:
    dice = np.random.default_rng(1)
    if mode == "I;16":
        return Image.fromarray(dice.integers(0, 65536, (12, 16), dtype=np.uint16))
    return Image.fromarray(dice.integers(0, 256, (12, 16, 4), dtype=np.uint8)).convert(mode)


def encoded(form: str, mode: str) -> bytes:
    buffer = io.BytesIO()
    picture(mode).save(buffer, form)
    return buffer.getvalue()


def pictures(folder: Path) -> None:
    kinds = [("PNG", "L"), ("PNG", "RGB"), ("PNG", "P"), ("PNG", "I;16"), ("JPEG", "L"), ("JPEG", "RGB"),
             ("BMP", "RGB"), ("PPM", "L"), ("PPM", "RGB"), ("TIFF", "RGB"), ("TIFF", "I;16"),
             ("WEBP", "RGB"), ("TGA", "RGBA"),
             ("GIF", "P"), ("DDS", "RGBA"), ("BMP", "P")]  # fmt: skip
    put(folder, {f"{form}-{mode.replace(';', '')}.{form.lower()}": encoded(form, mode) for form, mode in kinds})


def trajectories(folder: Path) -> None:
    stamps = np.arange(40, dtype=np.int64) * 50_000_000 + 1_403_636_580 * SECOND
    angle = np.linspace(0, 3, 40)
    positions = np.stack([np.cos(angle), np.sin(angle), 0.1 * angle], axis=1)
    turns = np.stack([0 * angle, 0 * angle, np.sin(angle / 2), np.cos(angle / 2)], axis=1)
    whole = SpatialTrajectory(stamps, positions, turns)
    for name in ("run.tum", "other.tum"):
        write_trajectory(folder / name, whole)
    rows = [f"{t},{','.join(map(repr, [*p, w, x, y, z]))}" for t, p, (x, y, z, w) in
            zip(stamps.tolist(), positions.tolist(), turns.tolist(), strict=True)]  # fmt: skip
    np.save(folder / "run.npy", np.column_stack([stamps / SECOND, positions, turns]))
    kitti = [" ".join(map(repr, T[:3].ravel().tolist())) for T in whole.matrices()]
    put(
        folder,
        {
            "data.csv": "\n".join(["#timestamp [ns],x,y,z,qw,qx,qy,qz", *rows, ""]),
            "00.txt": "\n".join([*kitti, ""]),
            "times.txt": "\n".join([f"{stamp / SECOND:.6f}" for stamp in stamps] + [""]),
        },
    )


def planned(folder: Path) -> None:
    """The plan of a campaign of two runs, and a note of one that could not be driven."""
    scenario, robot = load_scenario("house"), load_robot("turtlebot2")
    specs = [spec_of_tour(scenario, robot, ("0" * 64, "1" * 64), "karto", Mode.WITHOUT_MAP, seed) for seed in (0, 1)]
    refused = (Result("nowhere", Ending.REFUSED, "there is no such scenario"),)
    write_plan(folder, Campaign(name="fuzzed", scenarios=("house",), methods=("karto",)), Plan(tuple(specs), refused))
    keep(folder, Result(specs[0].title, Ending.FAILED, "the node burnt", specs[0]), "node7")


def run(folder: Path) -> None:
    """A measured run of three rounds over three goals; one goal fails."""
    with RunWriter(folder / "run") as writer:
        for number in range(3):
            writer.event(RoundStarted(100 * number * SECOND, number, priming=False))
            for goal, target in enumerate(GOALS):
                t = (100 * number + 30 * goal) * SECOND
                writer.event(GoalStarted(t, number, goal, target))
                at = SE2(target.x + 0.01 * number, target.y - 0.02 * goal, target.theta + 0.03)
                writer.pose("truth", number, t, at)
                writer.pose("estimate", number, t, at)
                if (number, goal) == (1, 1):
                    writer.event(GoalFailed(t + 5, number, goal, target, Outcome.LOST, "lost it", at, at, at))
                    writer.event(GoalSkipped(t + 5, number, goal))
                    continue
                writer.event(Arrival(t + 20 * SECOND, number, goal, target, at, at, at))
            writer.event(MethodNotice(100 * number * SECOND + 95, number, "a notice"))
            outcome = Outcome.LOST if number == 1 else Outcome.REACHED
            writer.event(RoundEnded((100 * number + 99) * SECOND, number, outcome, 900, 3))
        writer.event(RunEnded(300 * SECOND, complete=False))
        waypoints = [{"x": at.x, "y": at.y, "theta": at.theta} for at in GOALS]
        scenario = {"name": "made_up", "title": "Made up", "start": {"x": 0.0, "y": 0.0, "theta": 0.0},
                    "sequence": {"waypoints": waypoints}, "protocol": {"rounds": 3, "on_failure": "skip"},
                    "units": {"robot_diameter": 0.35, "field_of_view": 70.0}}  # fmt: skip
        measured = MeasuredFile(
            direction="outside-in", published=False, clock_offsets={"east": 0.1}, notes=("a note",),
            planes=(PlaneRow(camera="east", tilt=1, height=2, sd_tilt=0.1, sd_height=0.01, residual_px=0.2, places=5),),
            arrivals=tuple(
                ArrivalRow(round=number, goal=goal, priming=False, station="east", verdict="measured", reason="",
                           image="a.jpg", picture="a.jpg", frames=3, pose=(0.1, 0.2, 0.3), sd=(0.001, 0.001, 0.002),
                           residual_px=0.1, margin_px=20.0, spread_m=0.001, other_heading=None)
                for number in range(3) for goal in range(3)
            ),
        )  # fmt: skip
        place = writer.folder / "measured"
        put(place, {"arrivals.json": dump_measured(measured), "a.jpg": encoded("JPEG", "L")})
        save_floor_plan(FloorPlan(np.zeros((20, 30), np.uint8), 0.2, SE2()), writer.folder / "plan.yaml", "png")
        writer.finish(
            {
                "source": "measured", "driven_by": "robot", "scenario_name": "made_up", "scenario": scenario,
                "scenario_hash": "0" * 64, "method": "karto", "method_card": {"name": "karto", "kind": "slam"},
                "mode": "without-map", "seed": 0, "rounds": 3, "latency": "fixed", "wall_s": 30.0, "simulated_s": 300.0,
                "started_utc": "2030-01-01T00:00:00Z", "complete": False, "unjudged": {"2": "nobody watched"},
            }
        )  # fmt: skip


def compressed(folder: Path) -> None:
    """The same run with compressed trajectories."""
    run(folder)
    compress_trajectories(folder / "run")


def interrupted(folder: Path) -> None:
    """What two rounds of a run without map leave that was then killed."""
    journal = JournalWriter(folder / "journal.jsonl")
    for number in range(2):
        journal.write(RoundStarted(100 * number * SECOND, number, priming=False))
        journal.write(RoundEnded((100 * number + 99) * SECOND, number, Outcome.REACHED, 900, 3))
        tally = Tally(round=number, began_utc="2030-01-01T00:00:00Z", wall_s=1.0, compute_s=0.5, peak_bytes=1 << 20)
        add_tally(folder / "tally.jsonl", tally)
    journal.close()


def watched(folder: Path) -> None:
    """A campaign in the middle of its work: finished, under way, not to be driven, waiting."""
    write_watched(folder)


def served(folder: Path) -> None:
    """The record of a served robot."""
    content = Served(
        scenario={"name": "tour"}, robot={"name": "turtlebot2"}, seed=3, ros=1, variables={"ROS_DOMAIN_ID": "3"},
        pace="in step", epoch=1000 * SECOND, publishes_truth=False, versions={}, machine={}, started_utc="2030-01-01",
    )  # fmt: skip
    with ServedRecord(folder / "served", content) as record:
        for number in range(20):
            record.truth((1000 + number) * SECOND, SE2(0.1 * number, 0.0, 0.01 * number))
        record.end(20 * SECOND, 20.0, 0, 100)
    for file in (folder / "served").iterdir():
        file.rename(folder / file.name)
    (folder / "served").rmdir()


def connections(folder: Path) -> None:
    put(
        folder,
        {
            "robot.yaml": "graph: http://robot:11311\ntopics: {/scan: /front/scan, /cmd_vel: /base/cmd_vel}\n"
            "base: base_link\nlimits: {linear: 0.3, angular: 1.0}\nstop: /emergency_stop\n"
            "fresh: 0.4\nlook: 2\nclock: 0.1\n"
        },
    )


def card(folder: Path) -> None:
    """A method's card, as it is kept."""
    (folder / "karto.json").write_text(json.dumps(asdict(card_of("karto"))), encoding="utf-8")


def metrics(folder: Path) -> None:
    run(folder)
    write_metrics(folder, evaluate_runs([folder]))


def recording(folder: Path) -> None:
    (folder / "table").mkdir(parents=True)
    put(folder, {"table/frames.csv": "stamp_ns,picture,ids,clock_offset_s,clock_told_by\n1700,a.jpg,1 2,0.1,chrony\n"})


def karto_map(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    dice = np.random.default_rng(2)
    write_archive(
        folder / "map.npz", "karto", 1,
        {
            "settings": np.array("{}"), "poses": dice.normal(size=(3, 3)), "sizes": np.array([4, 5, 6]),
            "points": dice.normal(size=(15, 2)).astype(np.float32), "normals": np.zeros((15, 2), np.float32),
            "sensors": np.zeros((3, 2)), "edge_ends": np.array([[0, 1], [1, 2]]),
            "edge_strong": np.array([True, False]), "edge_poses": dice.normal(size=(2, 3)),
            "edge_covariances": np.stack([np.eye(3), 2 * np.eye(3)]),
        },
    )  # fmt: skip


def hector_map(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    levels = HectorMapper(HectorSettings()).levels
    arrays = {"settings": np.array("{}"), "resolutions": np.array([level.resolution for level in levels])}
    for number, level in enumerate(levels):
        side = 64 >> number
        grid = np.random.default_rng(number).uniform(-1, 1, (side, side)).astype(np.float32)
        arrays |= {f"log_odds_{number}": grid, f"origin_{number}": np.full(2, -8 * level.resolution)}
    write_archive(folder / "map.npz", "hector", 1, arrays)


def fast_lio2_map(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    points = np.arange(300.0).reshape(100, 3)
    write_archive(
        folder / "map.npz", "fast_lio2", 1, {"settings": np.array("{}"), "size": np.array(0.5), "points": points}
    )


def vocabulary(folder: Path) -> None:
    put(folder, {"voc.txt": "10 6 0 0\n" + "".join(f"{n} 1 {' '.join(['7'] * 32)} 0.5\n" for n in range(3))})


def trials(folder: Path) -> None:
    put(
        folder,
        {
            "planned_waypoints.txt": "1.0 2.0 0.5\n3.0 0.0 0.0\n",
            "visited_waypoints_nav_info.txt": "10.5 1.0 2.0 0.5 0 0\n20.5 3.0 0.0 0.0 1 0\n30.5 1.0 2.0 0.5 0 1\n",
            "act_poses.txt": "".join(f"{t}.25 {t} 0 0 0 0 0 1\n" for t in range(8, 36)),
            "robot_odoms.txt": "".join(f"{t}.25 {t} 0 0 0 0 0 1 0 0 0 0 0 0\n" for t in range(8, 36)),
        },
    )


def small_robot() -> Robot:
    robot = load_robot("turtlebot2_d435i")
    rig = robot.rig
    changes = {
        "stereo": load_robot("turtlebot2").rig.stereo.model_copy(update={"width": 32, "height": 24}),
        "rgbd": rig.rgbd.model_copy(update={"width": 16, "height": 16}),
        "lidar_2d": load_robot("turtlebot2").rig.lidar_2d.model_copy(update={"samples": 20}),
        "lidar_3d": load_robot("turtlebot2").rig.lidar_3d.model_copy(update={"rings": 2, "samples": 6}),
    }
    return robot.model_copy(update={"rig": rig.model_copy(update=changes)})


def drive() -> list[Measurement]:
    """Half a second of every sensor."""
    dice = np.random.default_rng(3)
    said: list[Measurement] = []
    for tick in range(1, 6):
        t = tick * 100_000_000 + SECOND
        said += [
            WheelOdometry(t, SE2(0.03 * tick, 0.0, 0.01 * tick), 0.3, 0.1),
            ImuSamples(t, np.array([t - 5, t]), dice.normal(size=(2, 3)), dice.normal(9.8, size=(2, 3))),
            LaserScan(t, dice.uniform(1, 5, 20).astype(np.float32), -1.5, 3.0 / 19, 0.1, 25.0),
            PointCloud(t, dice.normal(size=(6, 3)).astype(np.float32), np.repeat([0, 1], 3).astype(np.uint16),
                       np.zeros(6, np.int32)),
            StereoImages(t, *dice.integers(0, 256, (2, 24, 32), dtype=np.uint8)),
            RgbdImages(t, dice.integers(0, 256, (16, 16, 3), dtype=np.uint8), np.ones((16, 16), np.float32)),
        ]  # fmt: skip
    return said


def bag(form: str) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        said, robot = drive(), small_robot()
        writer = BagWriter(folder, "drive", form, robot, frozenset(one.sensor for one in said))
        for one in said:
            writer.measurement(one)
            if isinstance(one, WheelOdometry):
                writer.truth(one.stamp, one.T_odom_base)
        writer.close()

    return write


def euroc(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    writer = EurocWriter(folder, small_robot(), EUROC_SENSORS)
    for one in drive():
        if one.sensor in EUROC_SENSORS:
            writer.measurement(one)
        if isinstance(one, WheelOdometry):
            writer.truth(one.stamp, one.T_odom_base)
    writer.close()


def world(folder: Path) -> None:
    """A world with included models, meshes of every format, textures, a material script, lights and a state."""
    box = "<geometry><box><size>1 2 3</size></box></geometry>"
    forms = "".join(
        f"<visual name='v{n}'><geometry>{shape}</geometry><material><script><uri>file://look.material</uri>"
        "<name>Wood</name></script></material></visual>"
        for n, shape in enumerate(
            (
                "<sphere><radius>0.5</radius></sphere>", "<cylinder><radius>0.2</radius><length>1</length></cylinder>",
                "<plane><normal>0 0 1</normal><size>4 4</size></plane>", "<ellipsoid><radii>1 2 3</radii></ellipsoid>",
                "<polyline><height>1</height><point>0 0</point><point>1 0</point><point>0 1</point></polyline>",
            )
        )
    )  # fmt: skip
    meshes = "".join(
        f"<visual name='m{form}'><pose>0 0 1 0 0 0.5</pose><geometry><mesh><uri>model://thing/meshes/a.{form}</uri>"
        "<scale>1 1 2</scale></mesh></geometry></visual>"
        for form in ("dae", "obj", "stl", "glb")
    )
    put(
        folder,
        {
            "worlds/test.world": "<sdf version='1.7'><world name='w'><scene><ambient>0.4 0.4 0.4 1</ambient></scene>"
            "<include><uri>model://thing</uri><name>t</name><pose>1 2 0 0 0 0.5</pose></include>"
            f"<model name='m'><pose relative_to='t'>0 0 0 0 0 0</pose><link name='l'><collision name='c'>{box}"
            f"</collision>{forms}</link><frame name='f'><pose>1 0 0 0 0 0</pose></frame></model>"
            "<light name='sun' type='directional'><diffuse>1 1 1 1</diffuse><direction>0 0 -1</direction></light>"
            "<state world_name='w'><model name='m'><pose>0 1 0 0 0 0</pose><scale>1 1 1</scale></model></state>"
            "</world></sdf>",
            "worlds/look.material": "material Wood\n{\n technique {\n pass {\n diffuse 0.5 0.4 0.3 1\n"
            " texture_unit {\n texture wood.png\n scale 2 2\n }\n }\n }\n}\n",
            "worlds/wood.png": encoded("PNG", "RGB"),
            "models/thing/model.config": "<model><name>thing</name><sdf version='1.6'>model.sdf</sdf></model>",
            "models/thing/model.sdf": "<sdf version='1.6'><model name='thing'><link name='l'>"
            f"{meshes}</link></model></sdf>",
        },
    )
    meshes_in(folder / "models" / "thing" / "meshes")


def meshes_in(folder: Path) -> None:
    """The same tetrahedron in every format."""
    solid = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    points = "0 0 0 1 0 0 0 2 0 0 0 3"
    params = "".join(f"<param name='{axis}' type='float'/>" for axis in "XYZ")
    put(
        folder,
        {
            "a.stl": solid.export(file_type="stl"),
            "b.stl": solid.export(file_type="stl_ascii"),
            "a.glb": solid.export(file_type="glb"),
            "a.obj": "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\n"
            "usemtl paint\nf 1/1/1 3/2/1 2/3/1\nf 1/1/1 2/2/1 4/3/1\nf 1 4 3\nf 2 3 4\n",
            "a.mtl": "newmtl paint\nKd 1 0.5 0\nmap_Kd paint.png\n",
            "paint.png": encoded("PNG", "RGB"),
            "a.dae": f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><created>2020-01-01T00:00:00</created><modified>2020-01-01T00:00:00</modified><unit meter="0.5"/></asset>
<library_images><image id='i'><init_from>paint.png</init_from></image></library_images>
<library_effects><effect id="e"><profile_COMMON><newparam sid='f'><surface type='2D'><init_from>i</init_from></surface>
</newparam><newparam sid='s'><sampler2D><source>f</source></sampler2D></newparam><technique sid="c"><phong><diffuse>
<texture texture='s' texcoord='UV'/></diffuse></phong></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="mat" name="paint"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g" name="t"><mesh><source id="p">
<float_array id="pa" count="12">{points}</float_array>
<technique_common><accessor source="#pa" count="4" stride="3">{params}</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="4" material="m">
<input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry>
</library_geometries><library_visual_scenes><visual_scene id="vs"><node id='n' name='part'><translate>1 0 0</translate>
<instance_geometry url='#g'><bind_material><technique_common><instance_material symbol='m' target='#mat'/>
</technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#vs"/></scene></COLLADA>""",
        },
    )


def cached_world(folder: Path) -> None:
    with_files = folder.with_name("world")
    world(with_files)
    file = with_files / "worlds" / "test.world"
    found = Resources(search_roots(file, []))
    folder.mkdir(parents=True, exist_ok=True)
    save_cached(folder / "world.npz", import_sdf(file, found), found)


def prepared_world(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    save_prepared(folder / "ready.npz", prepare(conformance_world(), color=True))


def environment() -> None:
    """No folder of the user's is searched for models."""
    for variable in ("GAZEBO_MODEL_PATH", "GAZEBO_RESOURCE_PATH", "GZ_SIM_RESOURCE_PATH"):
        os.environ.pop(variable, None)
