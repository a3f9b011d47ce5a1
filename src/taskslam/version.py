"""The version of this package: that of the git tag from which it was installed (docs/releasing.md)."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("taskslam")
except PackageNotFoundError:  # sources on the path, nothing installed
    __version__ = "0+sources"
