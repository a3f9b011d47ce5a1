"""numba's caches hold pickles: no run leaves anything in them that another run of a method, or the benchmark, loads."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from adversaries.traces import LIMITS
from taskslam.geometry import SE2
from taskslam.measurements import WheelOdometry
from taskslam.processes import compiled_cache, landlock
from taskslam.robot import load_robot
from taskslam.slam.content import place_of
from taskslam.slam.guest import host as host_module
from taskslam.slam.guest.host import MethodHost


def test_a_view_is_links_and_only_what_is_new_and_plain_is_kept(tmp_path: Path) -> None:
    kept, view = tmp_path / "kept", tmp_path / "view"
    (kept / "module").mkdir(parents=True)
    (kept / "module" / "old.nbc").write_text("old")
    compiled_cache.lay_out(kept, view)
    assert (view / "module" / "old.nbc").is_symlink()
    (view / "module" / "new.nbc").write_text("new")
    (view / "module" / "new.nbi").write_text("index")
    (view / "module" / "stolen.nbc").symlink_to("/etc/passwd")
    os.mkfifo(view / "module" / "pipe.nbc")
    (view / "other.txt").write_text("not ours")
    assert compiled_cache.keep_new(view, kept) == 2
    assert sorted(p.name for p in kept.rglob("*")) == ["module", "new.nbc", "new.nbi", "old.nbc"]
    assert compiled_cache.keep_new(view, kept) == 2  # again is harmless
    assert (kept / "module" / "old.nbc").read_text() == "old"


def test_old_versions_of_a_method_are_forgotten(tmp_path: Path) -> None:
    view = tmp_path / "view"
    view.mkdir()
    (view / "a.nbc").write_text("x")
    for number in range(6):
        compiled_cache.keep_new(view, tmp_path / f"karto-{number}")
        os.utime(tmp_path / f"karto-{number}", (number, number))
    compiled_cache.keep_new(view, tmp_path / "karto-like-0")
    assert sorted(p.name for p in tmp_path.glob("karto*")) == [
        "karto-2",
        "karto-3",
        "karto-4",
        "karto-5",
        "karto-like-0",
    ]


def test_a_flood_is_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled_cache, "_MOST_BYTES", 10)
    (tmp_path / "view").mkdir()
    (tmp_path / "view" / "large.nbc").write_text("x" * 11)
    assert compiled_cache.keep_new(tmp_path / "view", tmp_path / "kept") == 0


@pytest.mark.skipif(not landlock.is_available(), reason="this kernel has no Landlock")
def test_what_is_compiled_before_the_first_measurement_is_kept_and_later_nothing(
    guests: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A method compiles a loop when it starts; later it tries to leave a message in the cache for its next run."""
    kept = tmp_path / "kept"
    monkeypatch.setattr(host_module, "place_of", lambda *_: kept)
    rig = load_robot("turtlebot2").rig
    said = []
    for number in range(2):
        log = tmp_path / "results" / f"{number}.log"
        log.parent.mkdir(exist_ok=True)
        with MethodHost("compiling:Compiling", {}, rig, log, None, LIMITS) as host:
            if number == 0:
                first = {path: path.read_bytes() for path in kept.rglob("*.nb?")}
            host.feed(WheelOdometry(0, SE2(), 0.0, 0.0))
            host.collect(0)
        said.append(log.read_text().split())
        assert {path: path.read_bytes() for path in kept.rglob("*.nb?")} == first
    assert len(first) == 2
    assert said == [["compiled", "denied"], ["loaded", "denied"]]


def test_registered_methods_have_a_place_and_others_none() -> None:
    from taskslam.slam.registry import find_method

    karto, hector = place_of("compiled", find_method("karto")), place_of("compiled", find_method("hector"))
    assert karto is not None
    assert hector is not None
    assert karto != hector
    assert place_of("compiled", find_method("anywhere:Method")) is None
