"""The sdist and the wheel: built from this tree, installed into a fresh environment, and at work there.

Dependencies are those of this environment; `make packages` installs them too, under every interpreter at hand.
"""

import os
import re
import site
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
pytest.importorskip("build", reason="comes with taskslam[dev]")


def run(*command, folder=None):
    """What it prints; it knows nothing of the sources that these tests may have on their path."""
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    words = [str(word) for word in command]
    done = subprocess.run(words, capture_output=True, text=True, timeout=300, cwd=folder, env=clean)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    """The last commit, apart from this tree: building leaves files beside the sources."""
    place = tmp_path_factory.mktemp("sources") / "taskslam"
    if not (ROOT / ".git").exists():
        pytest.skip("needs a git checkout")
    run("git", "clone", "--quiet", "--shared", ROOT, place)
    return place


@pytest.fixture(scope="module")
def built(sources, tmp_path_factory):
    """The sdist, and the wheel that is built from it."""
    out = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "build", "--outdir", out, sources)
    (sdist,), (wheel,) = out.glob("*.tar.gz"), out.glob("*.whl")
    return sdist, wheel


@pytest.fixture(scope="module")
def environment(built, tmp_path_factory):
    """A fresh environment with the wheel alone; what it needs is found in this one, after its own packages."""
    place = tmp_path_factory.mktemp("fresh")
    run(sys.executable, "-m", "venv", "--without-pip", place)
    python = place / "bin" / "python"
    run(sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--no-index", built[1])
    (packages,) = place.glob("lib/python*/site-packages")
    (packages / "of_the_tests.pth").write_text("\n".join(site.getsitepackages()) + "\n")
    return place


def inside(environment, folder, *words):
    return run(environment / "bin" / words[0], *words[1:], folder=folder)


def test_the_version_is_a_tag_or_on_its_way_to_one(built, environment, tmp_path):
    version = re.search(r"taskslam-(.+)\.tar\.gz", built[0].name)[1]
    assert re.fullmatch(r"\d+\.\d+\.\d+(\.dev\d+(\+g?[0-9a-f.d]+)?)?", version)
    assert built[1].name == f"taskslam-{version}-py3-none-any.whl"
    assert inside(environment, tmp_path, "taskslam", "--version").strip() == f"taskslam {version}"


def test_the_wheel_holds_every_file_of_the_package_and_nothing_else(sources, built):
    with zipfile.ZipFile(built[1]) as wheel:
        names = {name for name in wheel.namelist() if ".dist-info/" not in name}
    tracked = {name.removeprefix("src/") for name in run("git", "ls-files", "src", folder=sources).split()}
    assert "taskslam/report/page/templates/trajectories.html" in names
    assert names == tracked


def test_the_sdist_holds_the_tests_and_the_licence_and_nothing_large(built):
    with tarfile.open(built[0]) as sdist:
        names = {name.partition("/")[2] for name in sdist.getnames()}
    assert {"LICENSE", "pyproject.toml", "tests/test_packages.py", "docs/releasing.md"} <= names
    assert built[0].stat().st_size < 10e6
    assert built[1].stat().st_size < 5e6


def test_what_was_installed_works_without_the_sources(environment, tmp_path):
    where = inside(environment, tmp_path, "python", "-c", "import taskslam; print(taskslam.__file__)")
    assert Path(where.strip()).is_relative_to(environment)
    assert "karto" in inside(environment, tmp_path, "taskslam", "methods", "list")
    assert "house" in inside(environment, tmp_path, "taskslam", "worlds", "list")


def test_entry_points_name_what_is_there():
    groups = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]
    for target in (target for entries in groups.values() for target in entries.values()):
        module, _, name = target.partition(":")
        path = ROOT / "src" / Path(*module.split("."))
        text = next(file for file in (path.with_suffix(".py"), path / "__init__.py") if file.exists()).read_text()
        assert re.search(rf"^(?:class|def) {name}\b|^{name}\b", text, re.MULTILINE), target
