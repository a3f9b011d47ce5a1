"""What is public is listed once, documented and light to import."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import taskslam
from taskslam import api
from taskslam.errors import InputError

PAGE = Path(__file__).parents[1] / "docs" / "python.md"


def test_what_is_public_is_listed_documented_and_on_the_page() -> None:
    assert sorted([*api.__all__, "__version__"]) == sorted(taskslam.__all__)
    page = PAGE.read_text(encoding="utf-8")
    for name in api.__all__:
        assert getattr(taskslam, name) is getattr(api, name)
        assert getattr(api, name).__doc__
        assert f"`{name}`" in page, name


def test_importing_it_loads_nothing_until_it_is_used() -> None:
    code = "import sys, taskslam; print(sorted(m for m in sys.modules if m.startswith(('taskslam', 'numpy'))))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['taskslam', 'taskslam.version']"


def test_a_wrong_name_lists_what_there_is() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'laod'; it has .*load"):
        taskslam.laod  # noqa: B018


def test_wrong_words_are_one_sentence() -> None:
    with pytest.raises(InputError, match=r"mode 'with map': expected .* Did you mean 'with-map'"):
        taskslam.tour("house", "karto", mode="with map")
    with pytest.raises(InputError, match="latency 'slow': expected fixed"):
        taskslam.tour("house", "karto", latency="slow")


def test_recorded_trajectories_are_three_lines(tmp_path):
    for name, off in (("groundtruth", 0.0), ("orb_run0", 0.01), ("orb_run1", -0.01)):
        rows = [f"{t} {t} {t % 3 + off * (t % 2)} {t % 2} 0 0 0 1" for t in range(20)]
        (tmp_path / f"{name}.tum").write_text("\n".join(rows) + "\n")
    runs = [tmp_path / "orb_run0.tum", tmp_path / "orb_run1.tum"]
    results = taskslam.trajectories(tmp_path / "groundtruth.tum", runs, align="none")
    (orb,) = results.results
    assert [run.ate_m.rmse for run in orb.runs] == pytest.approx([0.01 / 2**0.5] * 2)
    assert orb.common.precision_m == pytest.approx(0.005)
    out = tmp_path / "out"
    exact = taskslam.trajectories(tmp_path / "groundtruth.tum", runs, out=out, n_to_align=5, rpe=["2m"])
    assert exact.results[0].alignment == "se3"
    assert (out / "report.html").read_text().startswith("<!doctype html>")
    assert taskslam.trajectories(out / "study.yaml").results[0].rpe == exact.results[0].rpe
    with pytest.raises(InputError, match="align: expected one of se3, sim3, yaw, origin, none"):
        taskslam.trajectories(tmp_path / "groundtruth.tum", runs, align="up")
    with pytest.raises(InputError, match=r"unknown key 'rep'.*Did you mean 'rpe'"):
        taskslam.trajectories(tmp_path / "groundtruth.tum", runs, rep="1m")
