"""Looking through the images of a recording, against the bare detector on the same frames: speed and memory.

Frames of 1920 x 1080 px: a textured floor, a robot's tag that rests and moves on in turns, read noise, JPEG. Both ways
read the same files. Processor time counts, of this process and of the detector's, since the machine may be shared; wall
time is shown beside it. The frames are gone through repeatedly, so that a longer stream shows whether memory grows.

    python benchmarks/tag_throughput.py [FRAMES]
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.ndimage import gaussian_filter

from taskslam.realworld.cameras.camera_model import Camera
from taskslam.realworld.cameras.images import read_grey
from taskslam.realworld.looks import Frame, look_through
from taskslam.realworld.tags.detector import Detector
from taskslam.realworld.tags.tag_family import code_cells

sys.path.insert(0, str(Path(__file__).parent))
from common import machine_line

WIDTH, HEIGHT, TAG, SIZE = 1920, 1080, 7, 0.19
FRAMES, DISTINCT, RESTING = 40, 20, 10
CAMERA = Camera.pinhole("overhead", WIDTH, HEIGHT, 1371.0)


def render(folder: Path) -> None:
    """Pictures of a tag that rests for ten frames, then is somewhere else."""
    from taskslam.lab.image import SAMPLES, Cards, draw, sheet
    from taskslam.lab.lens import Backdrop, pixel_corners

    rng = np.random.default_rng(0)
    corners = pixel_corners(WIDTH, HEIGHT)
    rays = CAMERA.undistort(corners.reshape(-1, 2)).reshape(corners.shape)
    texture = np.sum([gaussian_filter(rng.normal(0, s, (HEIGHT, WIDTH)), s) for s in (1.5, 6.0, 25.0)], axis=0)
    behind = Backdrop(
        np.clip(0.3 + 0.12 * texture / texture.std(), 0.02, 0.9).astype(np.float32),
        np.full((HEIGHT, WIDTH), np.inf, np.float32),
    )
    light = behind.radiance
    for number in range(DISTINCT):
        if number % RESTING == 0:
            x, y, yaw = rng.uniform([-1.2, -0.6, -np.pi], [1.2, 0.6, np.pi])
            c, s = np.cos(yaw), np.sin(yaw)
            pose = np.array([[c, s, 0, x], [s, -c, 0, y], [0, 0, -1, 2.5], [0, 0, 0, 1.0]])
            poses = np.ascontiguousarray(np.broadcast_to(pose, (SAMPLES, 1, 4, 4)))
            light, _ = draw(
                behind, rays, 1.0, Cards(sheet(code_cells("tag36h11", TAG))[None], SIZE * 1.25, poses), None
            )
            light = gaussian_filter(light, 0.7)
        grey = 250 * np.sqrt(light) + rng.normal(0, 2, light.shape)
        Image.fromarray(np.clip(grey, 0, 255).astype(np.uint8)).save(folder / f"{number:02}.jpg", quality=92)


def frames(folder: Path, count: int) -> list[Frame]:
    """A stream of so many frames at 5 Hz."""
    files = sorted(folder.glob("*.jpg"))
    return [Frame(k * 200_000_000, files[k % len(files)]) for k in range(count)]


def bare(stream: list[Frame], threads: int) -> tuple[int, float]:
    """The detector on whole images: tags found, and largest memory, MB."""
    with Detector(ids=[TAG], threads=threads) as detector:
        return sum(len(detector.detect(read_grey(frame.path))) for frame in stream), peak(detector)


def tracked(stream: list[Frame]) -> tuple[int, float]:
    """As a measurement looks through a recording: the same."""
    with Detector(ids=[TAG]) as detector:
        found = sum(len(look.tags) for look in look_through(stream, CAMERA, detector, [TAG], gamma=2.2))
        return found, peak(detector)


def peak(detector: Detector) -> float:
    """Largest resident memory so far of this process and the detector's, MB."""
    texts = [Path(f"/proc/{process}/status").read_text() for process in ("self", detector.pid)]
    return sum(int(text.split("VmHWM:")[1].split()[0]) for text in texts) / 1024


def measure(way: str, folder: Path, count: int) -> dict[str, float]:
    """In a process of its own: tags found, time a frame, largest memory of it and of the detector."""
    stream = frames(folder, count)
    bare(stream[:1], 1)  # imports and tables are not what is measured
    before = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    began = time.perf_counter()
    found, memory = tracked(stream) if way == "tracked" else bare(stream, int(way))
    wall = time.perf_counter() - began
    after = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    spent = sum(a.ru_utime + a.ru_stime - b.ru_utime - b.ru_stime for a, b in zip(after, before, strict=True))
    return {
        "found": found / count,
        "cpu_ms": 1000 * spent / count,
        "wall_ms": 1000 * wall / count,
        "memory_mb": memory,
    }


def main(count: int = FRAMES) -> None:
    print(machine_line())
    print(f"{'':<34}{'frames':>8}{'tag found':>11}{'CPU ms':>9}{'wall ms':>9}{'frames/s':>10}{'memory MB':>11}")
    results = {}
    with tempfile.TemporaryDirectory() as folder:
        render(Path(folder))
        ways = [("bare detector, 1 thread", "1", count), ("bare detector, 2 threads", "2", count)]
        ways += [
            ("looking through a recording", "tracked", count),
            ("the same, four times as long", "tracked", 4 * count),
        ]
        for label, way, length in ways:
            command = [sys.executable, __file__, "--one", way, folder, str(length)]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
            r = results[label] = json.loads(done.stdout)
            print(
                f"{label:<34}{length:>8}{100 * r['found']:>10.0f}%{r['cpu_ms']:>9.1f}{r['wall_ms']:>9.1f}"
                f"{1000 / r['wall_ms']:>10.1f}{r['memory_mb']:>11.0f}"
            )
    one, _, long, longer = results.values()
    print(f"looking through takes {one['cpu_ms'] / long['cpu_ms']:.1f} times less processor time")
    grown = longer["memory_mb"] - long["memory_mb"]
    print(f"memory grows by {grown:.1f} MB over {3 * count} more frames")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        print(json.dumps(measure(sys.argv[2], Path(sys.argv[3]), int(sys.argv[4]))))
    else:
        main(*map(int, sys.argv[1:2]))
