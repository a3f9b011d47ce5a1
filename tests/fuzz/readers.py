"""Every reader of the package: how it is called on a damaged example, and which modules that covers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from fuzz import examples
from taskslam.benchmark.campaign.campaign_file import load_campaign
from taskslam.benchmark.campaign.notes import notes
from taskslam.benchmark.campaign.plan_file import read_plan
from taskslam.benchmark.campaign.watching import Watched
from taskslam.datasets.bag_trajectories import read_bag_trajectory
from taskslam.datasets.image_files import read_image
from taskslam.datasets.opening import open_dataset
from taskslam.datasets.published_trials import read_goals, read_trial
from taskslam.datasets.trajectory_files import read_trajectory_file
from taskslam.evaluation import evaluate_runs, gate, gate_files
from taskslam.evaluation.evaluate import load_metrics
from taskslam.evaluation.run_metrics import run_metrics
from taskslam.lab.lab_file import load_lab
from taskslam.realworld.arrivals import read_arrivals
from taskslam.realworld.cameras.camera_files import load_camchain, load_camera
from taskslam.realworld.cameras.frame_folder import FrameFolder
from taskslam.realworld.cameras.images import read_grey
from taskslam.realworld.measured_file import load_measured
from taskslam.realworld.setup_file import InsideOutSetup, OutsideInSetup, Place, RunSource, Setup, load_setup
from taskslam.record import load_run
from taskslam.record.journal import read_journal
from taskslam.record.resumption import read_resumption
from taskslam.record.served import load_served
from taskslam.record.trajectories import read_spatial_trajectory
from taskslam.report import write_report
from taskslam.robot import load_robot
from taskslam.ros.connection import load_connection
from taskslam.ros.node_file import load_node
from taskslam.scenario import load_scenario
from taskslam.simulation.rendering.scene_cache import load_prepared
from taskslam.slam.cards import read_kept_card
from taskslam.slam.fast_lio2 import map_file as fast_lio2_map_file
from taskslam.slam.fast_lio2.voxel_map import VoxelMap
from taskslam.slam.hector import map_file as hector_map_file
from taskslam.slam.hector.mapper import HectorMapper
from taskslam.slam.hector.settings import HectorSettings
from taskslam.slam.karto import map_file as karto_map_file
from taskslam.slam.karto.mapper import Mapper
from taskslam.slam.karto.settings import KartoSettings
from taskslam.slam.orb.vocabulary import check_text
from taskslam.studies.study import load_study
from taskslam.studies.study_evaluation import evaluate_study
from taskslam.studies.study_settings import Settings
from taskslam.world.cache import load_cached
from taskslam.world.gazebo.left_out import LeftOut
from taskslam.world.gazebo.meshes import MeshLibrary
from taskslam.world.gazebo.resources import Resources
from taskslam.world.gazebo.textures import TextureStore, decode
from taskslam.world.loading import load_world
from taskslam.world.map_server import load_floor_plan
from taskslam.world.slicing import slice_floor_plan

MANY, FEW = 20_000, 500


@dataclass(frozen=True)
class Reader:
    """One reader. read: called with the example's folder and the name in it of the file that is damaged.

    example: writes whole files into a folder. covers: modules of the package whose reading this exercises. inputs: of
    a whole campaign. only: endings of the files that are damaged; all where it is empty.
    """

    name: str
    example: Callable[[Path], None]
    read: Callable[[Path, str], object]
    covers: tuple[str, ...]
    inputs: int = MANY
    only: tuple[str, ...] = ()

    def damages(self, path: Path) -> bool:
        return not self.only or path.name.endswith(self.only)


def one(read: Callable[[Path], object]) -> Callable[[Path, str], object]:
    """Reads the damaged file itself."""
    return lambda folder, name: read(folder / name)


def whole(read: Callable[[Path], object]) -> Callable[[Path, str], object]:
    """Reads the folder."""
    return lambda folder, _: read(folder)


def _planned(folder: Path) -> None:
    read_plan(folder)
    notes(folder)


def _watched(folder: Path) -> None:
    watched = Watched(folder)
    for run in watched.look().runs:
        watched.closer(run)


def _resumption(folder: Path) -> None:
    read_resumption(folder / "journal.jsonl", folder / "tally.jsonl")


def _scenario(folder: Path, name: str) -> None:
    file = {"list.yaml": "goals.yaml"}.get(name, name)
    load_scenario(folder / (file if file.endswith(".yaml") else "files.yaml"))


def _setup(folder: Path, name: str) -> None:
    load_setup(folder / name, OutsideInSetup if name == "outside.yaml" else InsideOutSetup)


def _camera(path: Path) -> None:
    load_camera(path)
    load_camera(path, "rectified") if path.name == "ros.yaml" else load_camchain(path)


def _study(folder: Path) -> None:
    evaluate_study(load_study(str(folder / "study.yaml")), Settings())


def _trajectory(folder: Path, name: str) -> None:
    if name == "times.txt":
        name = "00.txt"
    read_trajectory_file(str(folder / name), folder / "times.txt")
    if name.endswith(".tum"):
        read_spatial_trajectory(folder / name).planar()


def _run(folder: Path) -> None:
    record = load_run(folder / "run", damaged=True)
    for begun in record.rounds():
        for kind in ("truth", "estimate", "odometry"):
            record.trajectory(begun.round, kind)
    load_measured(record)
    run_metrics(record, "run").model_dump_json()


def _metrics(folder: Path) -> None:
    found = load_metrics(folder / "metrics.json")
    report = gate.judge(found.runs, found.runs, gate.parse_rules("precision:+10%,accuracy:+10%,completeness:-0"), ())
    gate_files.junit(report)
    gate_files.markdown(report)


def _arrivals(folder: Path, name: str) -> None:
    places = tuple(Place(x=at.x, y=at.y, heading=at.theta * 57.29577951308232) for at in examples.GOALS)
    source = RunSource(
        arrivals=(name if name != "planned_waypoints.txt" else "log.txt",), method="a", mode="without-map"
    )
    setup = Setup(runs=(source,), waypoints=None if name == "planned_waypoints.txt" else places)
    setup._folder = folder
    read_arrivals(source, setup)


def _mesh(folder: Path, name: str) -> None:
    name = {"a.mtl": "a.obj", "paint.png": "a.dae"}.get(name, name)
    resources = Resources((folder,))
    left_out = LeftOut()
    MeshLibrary(resources, TextureStore(resources, left_out), left_out).load(folder / name)


def _world(folder: Path) -> None:
    world = load_world(folder / "worlds" / "test.world", use_cache=False)
    slice_floor_plan(world, 0.02, 0.45)


def _texture(path: Path) -> None:
    decode(path.read_bytes())


def _dataset(path: Path) -> None:
    with open_dataset(path) as dataset:
        for _ in dataset.measurements(dataset.sensors):
            pass
        for _ in dataset.truth():
            pass


def _bag(folder: Path) -> None:
    (place,) = folder.iterdir()
    _dataset(place)


def _bag_trajectory(folder: Path) -> None:
    (place,) = folder.iterdir()
    read_bag_trajectory(place, "/odom")


def _report(folder: Path) -> None:
    evaluate_runs([folder])
    write_report([folder], folder.with_name("report.html"))


def _karto(path: Path) -> None:
    karto_map_file.read_map(path, Mapper(KartoSettings()))


def _hector(path: Path) -> None:
    hector_map_file.read_map(path, HectorMapper(HectorSettings()))


def _fast_lio2(path: Path) -> None:
    fast_lio2_map_file.read_map(path, VoxelMap(0.5, True))


examples.environment()
_SHIPPED = ("taskslam.user_files",)
_TABLES = ("taskslam.record.number_table", "taskslam.record.trajectories")
_BAGS = ("taskslam.datasets.bag_access", "taskslam.datasets.bag_files", "taskslam.datasets.bag")
_RUNS = ("taskslam.record.run_directory", "taskslam.record.journal", "taskslam.record.digests", "taskslam.record.place")

READERS = {
    reader.name: reader
    for reader in (
        Reader("scenario", examples.scenarios, _scenario,
               (*_SHIPPED, "taskslam.scenario.loading", "taskslam.scenario.waypoint_files")),
        Reader("robot", examples.shipped("taskslam.robot", "presets", "turtlebot2", "turtlebot2_d435i"),
               one(load_robot), ("taskslam.robot.robot",)),
        Reader("node", examples.shipped("taskslam.ros", "nodes", "slam_toolbox", "fast_lio2"), one(load_node),
               ("taskslam.ros.node_file",)),
        Reader("campaign", examples.shipped("taskslam.benchmark.campaign", "campaigns", "paper"), one(load_campaign),
               ("taskslam.benchmark.campaign.campaign_file",)),
        Reader("plan", examples.planned, whole(_planned),
               ("taskslam.benchmark.campaign.plan_file", "taskslam.benchmark.campaign.notes")),
        Reader("connection", examples.connections, one(load_connection), ("taskslam.ros.connection",)),
        Reader("served", examples.served, whole(load_served), ("taskslam.record.served",),
               only=("served.json", "truth.tum")),
        Reader("lab", examples.shipped("taskslam.lab", "labs", "house_cameras", "tsrb_long_ceiling"), one(load_lab),
               ("taskslam.lab.lab_file",)),
        Reader("setup", examples.setups, _setup, ("taskslam.realworld.setup_file",)),
        Reader("camera", examples.cameras, one(_camera), ("taskslam.realworld.cameras.camera_files",)),
        Reader("study", examples.study, whole(_study), ("taskslam.studies.study",)),
        Reader("trajectory", examples.trajectories, _trajectory,
               (*_TABLES, "taskslam.datasets.trajectory_files", "taskslam.datasets.trajectory_layout")),
        Reader("arrivals", examples.arrivals, _arrivals, ("taskslam.realworld.arrivals",)),
        Reader("trial", examples.trials, whole(lambda folder: read_trial(folder, read_goals(folder))),
               ("taskslam.datasets.published_trials",)),
        Reader("run", examples.run, whole(_run), (*_RUNS, "taskslam.realworld.measured_file"),
               only=("run.json", "journal.jsonl", ".tum", "arrivals.json")),
        Reader("journal", examples.run, one(read_journal), _RUNS, only=("journal.jsonl",)),
        Reader("resumption", examples.interrupted, whole(_resumption), ("taskslam.record.resumption",)),
        Reader("watched", examples.watched, whole(_watched),
               ("taskslam.record.newest", "taskslam.benchmark.campaign.watching"), FEW),
        Reader("compressed", examples.compressed, whole(_run), ("taskslam.record.compression",),
               only=(".gz",)),
        Reader("card", examples.card, one(partial(read_kept_card, method="karto")), ("taskslam.slam.cards",)),
        Reader("metrics", examples.metrics, whole(_metrics), ("taskslam.evaluation.metrics_file",),
               only=("metrics.json",)),
        Reader("report", examples.run, whole(_report), ("taskslam.report.page.photos", "taskslam.report.floor"), FEW),
        Reader("frames", examples.recording, whole(lambda folder: FrameFolder(folder / "table")),
               ("taskslam.realworld.cameras.frame_folder",)),
        Reader("floor_plan", examples.floor_plans,
               lambda folder, name: load_floor_plan((folder / name).with_suffix(".yaml"), free_205=True),
               ("taskslam.world.map_server",)),
        Reader("picture", examples.pictures, one(read_grey), ("taskslam.realworld.cameras.images",),
               only=(".png", ".jpeg", ".bmp", ".ppm", ".tiff", ".webp")),
        Reader("image", examples.pictures, one(partial(read_image, where="an image", size=None)),
               ("taskslam.datasets.image_files",), only=("L.png", "RGB.png", "L.jpeg", "RGB.jpeg", "RGB.bmp", ".ppm")),
        Reader("texture", examples.pictures, one(_texture), ("taskslam.world.gazebo.textures",)),
        Reader("karto_map", examples.karto_map, one(_karto), ("taskslam.slam.map_archive",)),
        Reader("hector_map", examples.hector_map, one(_hector), ("taskslam.slam.map_archive",)),
        Reader("fast_lio2_map", examples.fast_lio2_map, one(_fast_lio2), ("taskslam.slam.map_archive",)),
        Reader("vocabulary", examples.vocabulary, one(check_text), ("taskslam.slam.orb.vocabulary",)),
        Reader("mesh", examples.meshes_in, _mesh, ("taskslam.world.gazebo.meshes", "taskslam.world.gazebo.collada")),
        Reader("world", examples.world, whole(_world), ("taskslam.world.gazebo.resources",), FEW),
        Reader("cached_world", examples.cached_world, one(load_cached), ("taskslam.world.cache",)),
        Reader("prepared_world", examples.prepared_world, one(load_prepared),
               ("taskslam.simulation.rendering.scene_cache",)),
        Reader("euroc", examples.euroc, whole(_dataset),
               ("taskslam.datasets.asl_tables", "taskslam.datasets.euroc_folder"), FEW),
        Reader("rosbag1", examples.bag("rosbag1"), whole(_bag), _BAGS, FEW),
        Reader("rosbag2", examples.bag("rosbag2"), whole(_bag), _BAGS, FEW),
        Reader("mcap", examples.bag("mcap"), whole(_bag), _BAGS, FEW),
        Reader("bag_trajectory", examples.bag("mcap"), whole(_bag_trajectory), ("taskslam.datasets.bag_trajectories",),
               FEW),
    )
}  # fmt: skip
