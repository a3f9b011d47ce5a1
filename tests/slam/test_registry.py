"""Methods by name, ours and those that a package from outside registers."""

import subprocess
import sys
from pathlib import Path

import pytest

from taskslam.errors import InputError, MethodUnavailableError, UnknownMethodError
from taskslam.slam import registry
from taskslam.slam.base import Kind
from taskslam.slam.cards import card_of, inspect_method, inspect_methods
from taskslam.slam.guest import loading

THIRD_PARTY = Path(__file__).parent / "third_party"


@pytest.fixture
def taskslam(install, monkeypatch: pytest.MonkeyPatch):
    """Runs `taskslam ARGUMENTS` with the package from outside installed."""
    monkeypatch.setenv("PYTHONPATH", str(install(THIRD_PARTY)))
    monkeypatch.setenv("COLUMNS", "200")

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-c", "import sys; from taskslam.cli.main import main; main()", *arguments]
        return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)

    return run


def test_a_package_from_outside_adds_a_method_that_passes_the_checks(taskslam):
    listed = taskslam("methods", "list")
    assert listed.returncode == 0
    assert "dead_reckoning" in listed.stdout
    checked = taskslam("methods", "check", "dead_reckoning", "--minutes", "1")
    assert checked.returncode == 0, checked.stdout + checked.stderr
    assert "7 passed, 0 failed, 2 skipped" in checked.stdout


def test_options_reach_a_method_from_outside_and_a_failed_check_is_status_1(taskslam):
    checked = taskslam("methods", "check", "dead_reckoning", "--minutes", "1", "--option", "scale=0.5")
    assert checked.returncode == 1
    assert "failed  tracks_the_drive" in checked.stdout


def test_a_broken_plugin_is_shown_with_its_reason_and_hurts_nobody(taskslam):
    listed = taskslam("methods", "list")
    assert listed.returncode == 0
    assert "written for another version" in listed.stdout
    assert "wheel_odometry" in listed.stdout


def test_the_methods_of_this_package_are_registered():
    assert {"karto", "yag_slam", "wheel_odometry", "ground_truth"} <= registry.registered_methods().keys()


def test_only_ground_truth_is_a_reference():
    ours = [s for s in inspect_methods() if s.entry.distribution == "taskslam" and s.card]
    assert [s.entry.name for s in ours if s.card.kind is Kind.REFERENCE] == ["ground_truth"]


def test_an_unknown_name_lists_the_known_and_suggests_one():
    with pytest.raises(UnknownMethodError, match=r"known: .*karto.*Did you mean 'karto'\?"):
        card_of("karta")


def test_a_class_can_be_named_directly():
    found = card_of("taskslam.slam.methods.wheel_odometry:WheelOdometryMethod")
    assert found.name == "wheel_odometry"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("no_such_module_anywhere:Method", "there is no module 'no_such_module_anywhere'"),
        ("taskslam.slam.base:Absent", "has no class 'Absent'"),
        ("taskslam.geometry:SE2", "not a subclass"),
    ],
)
def test_what_is_not_a_method_says_why(name, words):
    with pytest.raises(InputError, match=words):
        card_of(name)


def test_an_absent_package_names_the_extra_that_brings_it(monkeypatch):
    entry = registry.MethodEntry("yag_slam", "needs_yag:Method", "taskslam")
    monkeypatch.setattr(registry, "registered_methods", lambda: {"yag_slam": entry})

    def fail(_name):
        raise ModuleNotFoundError("No module named 'yag_slam'", name="yag_slam")

    monkeypatch.setattr(loading.importlib, "import_module", fail)
    with pytest.raises(MethodUnavailableError, match=r"extra 'yag-slam': pip install 'taskslam\[yag-slam\]'"):
        loading.load_method("yag_slam")


def test_a_method_whose_extra_is_not_installed_is_listed_with_the_command(guests, monkeypatch):
    def absent(_package):
        raise registry.metadata.PackageNotFoundError

    monkeypatch.setattr(registry.metadata, "version", absent)
    state = inspect_method("yag_slam")
    assert state.card is not None
    assert "pip install 'taskslam[yag-slam]'" in state.problem
    assert inspect_method("karto").problem == ""
