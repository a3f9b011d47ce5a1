import re

import pytest
import typer
from typer.testing import CliRunner

from taskslam.cli.doctor import doctor
from taskslam.cli.methods import app, parse_options
from taskslam.errors import InputError, UnknownMethodError


@pytest.fixture
def invoke(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")

    def run(*arguments):
        return CliRunner().invoke(app, list(arguments))

    return run


def test_list_fits_a_terminal_and_names_every_method(invoke):
    result = invoke("list")
    assert result.exit_code == 0
    assert max(map(len, result.stdout.splitlines()[:8])) <= 80
    assert "…" not in result.stdout
    assert re.search(
        r"^wheel_odometry +odometry +wheel_odometry +Apache-2.0 +none +yes +yes", result.stdout, re.MULTILINE
    )


def test_show_prints_the_card(invoke):
    result = invoke("show", "ground_truth")
    assert result.exit_code == 0
    assert re.search(r"kind +reference", result.stdout)
    assert re.search(r"sensors +true_pose", result.stdout)


def test_check_prints_each_result_and_a_sum(invoke):
    result = invoke("check", "wheel_odometry", "--minutes", "1")
    assert result.exit_code == 0
    assert "passed  determinism: two runs gave the same bytes" in result.stdout
    assert result.stdout.rstrip().endswith("7 passed, 0 failed, 2 skipped")


def test_check_of_wrong_options_fails(invoke):
    result = invoke("check", "karto", "--option", "resolutoin=0.05")
    assert result.exit_code == 1
    assert "resolutoin" in result.stdout


def test_an_unknown_method_is_an_error_with_a_hint(invoke):
    result = invoke("show", "kartoo")
    assert isinstance(result.exception, UnknownMethodError)
    assert "Did you mean 'karto'?" in str(result.exception)


def test_options_are_typed():
    assert parse_options(["a=0.5", "b=true", "c=text", "d=", "e=x=y"]) == {
        "a": 0.5,
        "b": True,
        "c": "text",
        "d": None,
        "e": "x=y",
    }
    for wrong in ("a", "=1", "a=[1"):
        with pytest.raises(InputError, match="--option"):
            parse_options([wrong])


def test_doctor_finds_the_main_job_possible_and_names_absent_folders(monkeypatch, tmp_path):
    monkeypatch.setenv("TASKSLAM_DATA", str(tmp_path / "absent"))
    program = typer.Typer()
    program.command()(doctor)
    result = CliRunner().invoke(program)
    assert result.exit_code == 0
    assert re.search(r"ok +embreex", result.stdout)
    assert re.search(r"note +TASKSLAM_DATA", result.stdout)
    assert f"there is no {tmp_path / 'absent'}" in result.stdout.replace("\n", "")


def test_doctor_says_how_to_get_what_is_missing(monkeypatch):
    from taskslam.cli import doctor as module

    monkeypatch.setattr(module, "_CORE", ("numpy", "a-package-that-nobody-has"))
    program = typer.Typer()
    program.command()(doctor)
    result = CliRunner().invoke(program)
    assert result.exit_code == 3
    assert re.search(r"missing +a-package-that-nobody-has +not installed\n.*→ pip install a-package", result.stdout)
