import importlib.util

import pytest

from taskslam.cli.doctor import Health, system_libraries
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
