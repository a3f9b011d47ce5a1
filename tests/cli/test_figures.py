import pytest
from typer.testing import CliRunner

from taskslam.cli.app import app
from taskslam.errors import InputError


def test_figures_and_tables_are_written_in_the_chosen_format(results, tmp_path):
    result = CliRunner().invoke(app, ["figures", str(results), "--out", str(tmp_path / "out"), "--format", "svg"])
    assert result.exit_code == 0, result.output
    files = {path.relative_to(tmp_path / "out").as_posix() for path in (tmp_path / "out").rglob("*.*")}
    assert {"cumulative_precision.svg", "violins_accuracy.svg", "tables/methods.tex", "tables/waypoints.csv"} <= files
    assert not any(name.endswith((".pdf", ".png", ".partial")) for name in files)


def test_an_unknown_format_is_refused_before_anything_is_read(results, tmp_path):
    result = CliRunner().invoke(app, ["figures", str(results), "--out", str(tmp_path / "out"), "--format", "pdff"])
    assert isinstance(result.exception, InputError)
    assert "Did you mean 'pdf'?" in str(result.exception)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("text", ["", " , "])
def test_no_format_at_all_is_refused(results, text):
    assert isinstance(CliRunner().invoke(app, ["figures", str(results), "--format", text]).exception, InputError)
