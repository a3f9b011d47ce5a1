"""A large world is made ready once; later processes read what the first one made, and see the same."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from taskslam.benchmark.conformance_eyes import conformance_world
from taskslam.geometry import OPTICAL_IN_BODY, SE2
from taskslam.simulation.rendering import scene_cache
from taskslam.simulation.rendering.prepared_world import prepare
from taskslam.simulation.rendering.rasterizer import Pinhole
from taskslam.simulation.rendering.scene import Scene
from taskslam.world import World


@pytest.fixture(scope="module")
def world() -> World:
    return conformance_world()


@pytest.fixture(autouse=True)
def made(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[bool]:
    """Everything is worth keeping, in a cache of its own; a list of what was made, in colour or not."""
    monkeypatch.setenv("TASKSLAM_CACHE", str(tmp_path))
    monkeypatch.setattr(scene_cache, "_WORTH_KEEPING", 0)
    worlds: list[bool] = []

    def counted(world: World, color: bool) -> Any:
        worlds.append(color)
        return prepare(world, color)

    monkeypatch.setattr(scene_cache, "prepare", counted)
    return worlds


def arrays_of(ready: object) -> Iterator[tuple[str, np.ndarray]]:
    return scene_cache._packed("", ready)


@pytest.mark.parametrize("color", [False, True])
def test_what_was_kept_is_what_was_made(world: World, made: list[bool], color: bool) -> None:
    T = SE2(0.0, -1.0, 0.3).matrix() @ OPTICAL_IN_BODY
    first, second = Scene(world, color), Scene(world, color)
    assert made == [color]
    for (name, one), (_, other) in zip(arrays_of(first._ready), arrays_of(second._ready), strict=True):
        assert (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes()), name
        assert other.flags.c_contiguous, name
        assert other.ndim == 0 or other.flags.writeable, name  # numba would compile for it once more
    views = [scene.view(T, Pinhole(64, 48, 40.0, (32.0, 24.0))).radiance_root for scene in (first, second)]
    assert views[0].tobytes() == views[1].tobytes()
    assert np.ptp(views[0]) > 0


def brighter(world: World) -> World:
    return replace(world, ambient=(0.9, 0.9, 0.9))


def moved(world: World) -> World:
    return replace(world, visual=replace(world.visual, vertices=world.visual.vertices + np.float32(0.01)))


@pytest.mark.parametrize("other", [brighter, moved])
def test_another_world_is_not_taken_for_it(world: World, made: list[bool], other: Callable[[World], World]) -> None:
    Scene(world), Scene(other(world)), Scene(world, color=True)
    assert made == [False, False, True]


def test_other_code_makes_it_anew(world: World, made: list[bool], monkeypatch: pytest.MonkeyPatch) -> None:
    Scene(world)
    monkeypatch.setattr(scene_cache, "_code", lambda: "other")
    Scene(world)
    assert made == [False, False]


@pytest.mark.parametrize(
    "damage", [lambda data: data[: len(data) // 2], lambda data: b"", lambda data: b"\0" + data[1:]]
)
def test_a_damaged_file_is_made_again(
    world: World, made: list[bool], tmp_path: Path, damage: Callable[[bytes], bytes]
) -> None:
    Scene(world)
    (file,) = (tmp_path / "scenes").iterdir()
    file.write_bytes(damage(file.read_bytes()))
    Scene(world)
    Scene(world)
    assert made == [False, False]


def test_a_bit_that_flipped_is_noticed(world: World, made: list[bool], tmp_path: Path) -> None:
    Scene(world)
    (file,) = (tmp_path / "scenes").iterdir()
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 4
    file.write_bytes(data)
    Scene(world)
    assert made == [False, False]


def test_no_place_to_keep_it_is_no_error(world: World, made: list[bool], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TASKSLAM_CACHE", "/dev/null/nowhere")
    Scene(world)
    Scene(world)
    assert made == [False, False]


def test_a_small_world_is_not_kept_and_old_files_go(
    world: World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scene_cache, "_MOST_KEPT", 2)
    for number in range(4):
        Scene(replace(world, background=(0.1 * number, 0.0, 0.0)))
    assert len(list((tmp_path / "scenes").iterdir())) == 2
    monkeypatch.setattr(scene_cache, "_WORTH_KEEPING", len(world.visual) + 1)
    before = sorted((tmp_path / "scenes").iterdir())
    Scene(replace(world, background=(0.9, 0.0, 0.0)))
    assert sorted((tmp_path / "scenes").iterdir()) == before
