"""Every reader survives a few damaged files here, and many under `make fuzz`; and none is missing from the list."""

from __future__ import annotations

import ast
import resource
import signal
import time
import warnings
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from fuzz.campaign import LONGEST
from fuzz.readers import READERS
from fuzz.worker import Inputs, limit_memory, verdict

SOURCE = Path(__file__).parents[2] / "src"
BUDGET = 12.0  # s for all of them

OPENERS = {
    "open_file", "read_bytes", "read_text", "read_json", "read_arrays", "arrays_in", "opened_picture",
    "read_model", "read_mapping", "Shipped", "Rosbag1Reader", "Rosbag2Reader", "Ros1Reader", "Ros2Reader",
    "cv2.VideoCapture",
}  # fmt: skip
"""Whoever calls one of these reads a file: our readers with bounds, and the libraries that open files themselves."""

EXCUSED = {
    "taskslam.ros.check": "lines that our own adapter and a node print into a log of bounded length",
    "taskslam.reading": "the bounded readers themselves",
    "taskslam.realworld.cameras.video_source": "OpenCV decodes live cameras and videos, in code that is not ours",
    "taskslam.benchmark.engines.luggage": "files that the readers of worlds and maps have just read, as bytes",
    "taskslam.benchmark.engines.slurm": "numbers and specs that our own engine wrote; a spec checks itself",
    "taskslam.benchmark.one_processor": "a name that is compared and shown",
    "taskslam.report.tables.marked_part": "a page that a person wrote, in which two lines are looked for",
    "taskslam.benchmark.verify": "a spec, which checks itself, and lines of two records, to say where they differ",
    "taskslam.evaluation.run_index": "a copy that polars decodes, in code that is not ours, and that is made again",
    "taskslam.realworld.cameras.calibration_images": "pictures by read_grey, videos by OpenCV",
}

RAW = {
    "open", "io.open", "os.open", "os.fdopen", "np.load", "np.loadtxt", "np.genfromtxt", "np.fromfile", "np.memmap",
    "json.load", "json.loads", "yaml.load", "yaml.safe_load", "Image.open", "cv2.imread", "ET.parse", "SafeXml.parse",
    "zipfile.ZipFile", "tarfile.open", "sqlite3.connect", "csv.reader", "tomllib.load", "pickle.load",
}  # fmt: skip
"""Ways past them, beside the methods of a path: `open` with a mode, `read_bytes`, `read_text`."""

RAW_EXCUSED = {
    "taskslam.reading": "opens for everybody",
    "taskslam.files": "opens to write, and folders to sync them",
    "taskslam.record.run_lock": "opens to lock",
    "taskslam.record.place": "opens to sync",
    "taskslam.record.resumption": "opens to write",
    "taskslam.record.newest": "opens to write",
    "taskslam.record.served": "opens to write",
    "taskslam.ros.ros2.bridge_process": "frames of bounded length from our own process",
    "taskslam.ros.ros2.domain": "opens files in shared memory to try their locks",
    "taskslam.benchmark.sealing": "a secret of 32 bytes, of which no more are read",
    "taskslam.endings": "opens to write",
    "taskslam.processes.compiled_cache": "bytes that are copied and not read",
    "taskslam.processes.guest": "pipes, /proc, and logs to write",
    "taskslam.processes.scratch": "files of a guest, which the caller bounds",
    "taskslam.processes.tree": "/proc",
    "taskslam.slam.content": "source files of installed packages",
    "taskslam.record.journal": "opens to write",
    "taskslam.processes.landlock": "opens folders to wall them off",
    "taskslam.processes.messages": "messages of bounded length from a method's process",
    "taskslam.processes.memory": "/proc",
    "taskslam.benchmark.campaign.plan_file": "tours that were just dumped",
    "taskslam.benchmark.campaign.price": "a table of this package",
    "taskslam.benchmark.engines.allotment": "what the kernel says of a control group",
    "taskslam.benchmark.engines.ray": "an archive in memory, whose content is checked as a run",
    "taskslam.benchmark.engines.slurm": "a line that our own engine wrote",
    "taskslam.benchmark.engines.slurm_task": "a line that our own engine wrote",
    "taskslam.benchmark.engines.supervised": "lines that our own worker prints",
    "taskslam.benchmark.engines.worker": "the order that our own engine gives",
    "taskslam.benchmark.run": "/proc, and a card that was just dumped",
    "taskslam.datasets.euroc_writer": "opens to write",
    "taskslam.lab.folder": "opens to write",
    "taskslam.realworld.cameras.frame_folder": "opens to write",
    "taskslam.realworld.tags.detector_child": "the settings that our own process gives",
    "taskslam.report.page.shell": "templates of this package",
    "taskslam.report.page.calibration_page": "templates of this package",
    "taskslam.slam.map_archive": "opens to write",
    "taskslam.slam.orb.vocabulary": "the vocabulary that ships with this package",
    "taskslam.simulation.rendering.scene_cache": "opens to write",
    "taskslam.simulation.sensors.raytracing": "the kernel's list of loaded libraries",
    "taskslam.slam.orb.equal_views": "the library of an installed package",
    "taskslam.slam.orb.start_map": "a scratch file of ORB-SLAM3's own",
    "taskslam.user_files": "files of this package",
    "taskslam.world.cache": "source files of this package, and the text of an array read with bounds",
}


@cache
def calls() -> list[tuple[str, str, ast.Call]]:
    """Module, what is called, and the call, over the package but the guests' hosts, which read no files."""
    found = []
    for path in sorted(SOURCE.rglob("*.py")):
        module = ".".join(path.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__")
        if not module.startswith("taskslam.slam.guest"):
            nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            found += [(module, ast.unparse(node.func), node) for node in nodes if isinstance(node, ast.Call)]
    return found


def test_every_module_that_reads_files_is_fuzzed():
    reading = {module for module, name, _ in calls() if name in OPENERS}
    covered = {module for reader in READERS.values() for module in reader.covers}
    assert len(reading) > 25
    assert sorted(reading - covered - EXCUSED.keys()) == []


def test_nobody_reads_a_file_past_the_readers_with_bounds():
    def is_raw(name: str, call: ast.Call) -> bool:
        words = [part.value for part in call.args if isinstance(part, ast.Constant)]
        opened = name.endswith(".open") and any(str(word).strip("rwxab+t") == "" for word in words)
        return name in RAW or name.endswith((".read_bytes", ".read_text")) or opened

    found = {module for module, name, call in calls() if is_raw(name, call)}
    assert sorted(found - RAW_EXCUSED.keys()) == []
    assert sorted(RAW_EXCUSED.keys() - found) == []


@contextmanager
def limits():
    """A gibibyte more, and an alarm that ends what hangs."""

    def hangs(*_: object) -> None:
        raise TimeoutError(f"more than {LONGEST:g} s")

    before, handler = resource.getrlimit(resource.RLIMIT_AS), signal.signal(signal.SIGALRM, hangs)
    limit_memory()
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, handler)
        resource.setrlimit(resource.RLIMIT_AS, before)


def test_every_reader_survives_a_few_damaged_files(tmp_path):
    end = time.monotonic() + BUDGET
    faults = []
    for place, reader in enumerate(READERS.values()):
        inputs = Inputs(reader, 99, tmp_path / reader.name / "example")
        enough = time.monotonic() + max(0.0, end - time.monotonic()) / (len(READERS) - place)
        for number in range(50):
            with inputs.damaged(number) as name, limits(), warnings.catch_warnings(action="ignore"):
                signal.alarm(int(LONGEST))
                kind, words = verdict(reader, inputs.folder, name)
            if kind == "fault":
                faults.append((reader.name, number, name, words))
            if time.monotonic() > enough:
                break
    assert faults == []
