import subprocess
import sys

import pytest
import typer
from typer.testing import CliRunner

from taskslam.cli.report import report
from taskslam.errors import RecordError


def test_a_folder_without_runs_is_refused_in_a_sentence(tmp_path):
    app = typer.Typer()
    app.command()(report)
    result = CliRunner().invoke(app, [str(tmp_path), "--out", str(tmp_path / "r.html")])
    assert isinstance(result.exception, RecordError)
    assert "holds no run" in str(result.exception)


def test_help_shows_examples():
    app = typer.Typer()
    app.command()(report)
    assert "Examples" in CliRunner().invoke(app, ["--help"]).output


def test_help_is_quick():
    """Heavy packages are imported by the verb, not by its module."""
    modules = "import sys, taskslam.cli.report, taskslam.cli.evaluate"
    code = f"{modules}; print([name for name in ('numpy', 'jinja2', 'rich') if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("name", ["report.html", "deep/er/page.html"])
def test_the_page_is_written_where_asked(results, tmp_path, name):
    app = typer.Typer()
    app.command()(report)
    result = CliRunner().invoke(app, [str(results), "--out", str(tmp_path / name)])
    assert result.exit_code == 0, result.output
    assert "synthetic" in (tmp_path / name).read_text()
    assert str(tmp_path / name) in result.output.replace("\n", "")
