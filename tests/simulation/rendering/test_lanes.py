"""The same picture on every processor, byte for byte, and the picture that plain arithmetic gives (decision 003)."""

from __future__ import annotations

import hashlib
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from taskslam.geometry import OPTICAL_IN_BODY, SE2, FloatArray
from taskslam.simulation.rendering.rasterizer import Pinhole
from taskslam.simulation.rendering.scene import Scene
from taskslam.simulation.sensors.counted_noise import standard_normal
from taskslam.simulation.sensors.read_noise import develop
from taskslam.world.loading import load_world

PINHOLE = Pinhole(188, 120, 90.0, (94.0, 60.0))
# What each needs of the machine, as /proc/cpuinfo calls it.
PROCESSORS = {"x86-64": "sse2", "x86-64-v3": "avx2", "x86-64-v4": "avx512vl"}


def views() -> list[FloatArray]:
    """From the height of the robot's camera, about a furnished room."""
    lift = np.eye(4)
    lift[2, 3] = 0.31
    places = [SE2(-6.0 + 2.0 * k, -2.0 + 0.5 * k, 1.1 * k) for k in range(5)]
    return [place.matrix() @ lift @ OPTICAL_IN_BODY for place in places]


def fingerprint() -> str:
    """SHA-256 of what a few views of the house hold, before exposure and noise and after, and of noise alone."""
    scene, digest = Scene(load_world("house")), hashlib.sha256()
    for T in views():
        view = scene.view(T, PINHOLE)
        digest.update(view.radiance_root.tobytes() + view.drawn.tobytes())
        digest.update(develop(view.radiance_root, 0.8, 5.0, key=3).tobytes())
    digest.update(standard_normal(3, (7040,)).tobytes())
    return digest.hexdigest()


def test_every_processor_gives_the_same_bytes(tmp_path: Path) -> None:
    flags = Path("/proc/cpuinfo").read_text(encoding="utf-8").split()
    able = [name for name, needs in PROCESSORS.items() if needs in flags]
    if len(able) < 2:
        pytest.skip("this machine can be one processor only")
    running = {}
    for name in able:
        environment = os.environ | {
            "NUMBA_CPU_NAME": name,
            "NUMBA_CPU_FEATURES": "",
            "NUMBA_CACHE_DIR": str(tmp_path / name),
        }
        command = [sys.executable, "-c", "from test_lanes import fingerprint; print(fingerprint())"]
        running[name] = subprocess.Popen(
            command, cwd=Path(__file__).parent, env=environment, stdout=subprocess.PIPE, text=True
        )
    told = {name: process.communicate(timeout=300)[0].strip() for name, process in running.items()}
    assert all(process.returncode == 0 for process in running.values())
    assert set(told.values()) == {fingerprint()}


@pytest.mark.parametrize("width", [1, 2, 15, 16, 17, 33])
def test_pictures_of_any_width_agree_where_they_overlap(width: int) -> None:
    """Segments end where a picture ends: nothing is written beyond; where one began hardly matters."""
    scene, T = Scene(load_world("house")), views()[1]
    whole = scene.view(T, PINHOLE)
    narrow = scene.view(T, Pinhole(width, PINHOLE.height, PINHOLE.focal, PINHOLE.center))
    assert np.array_equal(narrow.drawn, whole.drawn[:, :width])
    assert np.abs(narrow.radiance_root - whole.radiance_root[:, :width]).max() < 8 / 255
    assert math.isfinite(float(narrow.radiance_root.sum()))
