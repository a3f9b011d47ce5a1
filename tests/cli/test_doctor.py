import importlib.util

import pytest

from taskslam.cli import doctor
from taskslam.cli.doctor import Health, many_runs, system_libraries
from taskslam.slam.orb import system_libraries as orb_libraries


@pytest.fixture
def installed(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: object())


@pytest.mark.usefixtures("installed")
def test_absent_system_libraries_come_with_the_command_that_brings_them(monkeypatch):
    monkeypatch.setattr(orb_libraries, "LIBRARIES", {"libnothing-of-the-kind.so.7": "libnothing7"})
    (finding,) = system_libraries()
    assert finding.health is Health.NOTE
    assert "libnothing-of-the-kind.so.7" in finding.detail
    assert finding.remedy == "apt install libnothing7"


@pytest.mark.usefixtures("installed")
def test_libraries_that_are_there_are_good(monkeypatch):
    monkeypatch.setattr(orb_libraries, "LIBRARIES", {"libc.so.6": "libc6"})
    (finding,) = system_libraries()
    assert finding.health is Health.GOOD


def test_a_package_that_is_not_installed_needs_no_libraries(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert system_libraries() == []


def test_clusters_and_tables_are_extras_and_say_how_to_get_them(monkeypatch, tmp_path):
    monkeypatch.setattr(doctor, "_MANY_RUNS", {"no-such-package-at-all": "runs", "pydantic": "ray"})
    monkeypatch.setenv("PATH", str(tmp_path))
    absent, present, slurm = many_runs()
    assert (absent.health, absent.remedy) == (Health.NOTE, "pip install 'taskslam[runs]'")
    assert present.health is Health.GOOD
    assert (slurm.health, "no sbatch" in slurm.detail) == (Health.NOTE, True)
    (tmp_path / "sbatch").write_text("#!/bin/sh\n")
    (tmp_path / "sbatch").chmod(0o755)
    assert many_runs()[2].health is Health.GOOD
