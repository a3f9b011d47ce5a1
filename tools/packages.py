"""`make packages`: sdist and wheel in dist/, and the wheel at work under every Python that it is for.

Each interpreter at hand (or named: `make packages PYTHONS="python3.12 /opt/python3.13/bin/python3"`) gets a fresh
environment, the wheel with all that it needs, and drives a short tour. Where a version has none, pip resolves.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
VERSIONS = ("3.11", "3.12", "3.13")
TOUR = ("run", "house", "--method", "karto", "--mode", "without-map", "--rounds", "1", "--set", "sequence.path=[0, 0]")


def run(*command: object, folder: Path | None = None) -> str:
    """What it prints; ends with what it said if it failed."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, cwd=folder, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
    return done.stdout


def version_of(python: str) -> str:
    return run(python, "-c", "import sys; print('%d.%d' % sys.version_info[:2])").strip()


def build() -> Path:
    """Both packages in dist/, which holds nothing else; the wheel is made from the sdist."""
    out = ROOT / "dist"
    shutil.rmtree(out, ignore_errors=True)
    run(sys.executable, "-m", "build", "--outdir", out, ROOT)
    for path in sorted(out.iterdir()):
        print(f"{path.name}: {path.stat().st_size / 1e6:.1f} MB", flush=True)
    return next(out.glob("*.whl"))


def try_out(python: str, wheel: Path, folder: Path) -> str:
    """Install into a fresh environment and drive."""
    run(python, "-m", "venv", folder / "environment")
    own = folder / "environment" / "bin"
    run(own / "python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check", wheel)
    run(own / "python", "-m", "pip", "check")
    run(own / "taskslam", *TOUR, "--out", folder / "results", folder=folder)
    run(own / "taskslam", "report", folder / "results", "--out", folder / "report.html", folder=folder)
    return run(own / "taskslam", "--version").strip()


def resolve(version: str, wheel: Path, folder: Path) -> None:
    """What pip would install under a version that is not here."""
    how = ("--dry-run", "--quiet", "--ignore-installed", "--only-binary=:all:", "--target", folder)
    run(sys.executable, "-m", "pip", "install", *how, "--python-version", version, wheel)


def main() -> None:
    pythons = sys.argv[1:] or [found for version in VERSIONS if (found := shutil.which(f"python{version}"))]
    wheel = build()
    tried = set()
    for python in pythons:
        version, begin = version_of(python), time.monotonic()
        tried.add(version)
        with tempfile.TemporaryDirectory() as folder:
            said = try_out(python, wheel, Path(folder))
        print(f"Python {version}: {said} installs and drives, {time.monotonic() - begin:.0f} s", flush=True)
    for version in sorted(set(VERSIONS) - tried):
        with tempfile.TemporaryDirectory() as folder:
            resolve(version, wheel, Path(folder))
        print(f"Python {version}: not here; pip finds a wheel of everything", flush=True)


if __name__ == "__main__":
    main()
