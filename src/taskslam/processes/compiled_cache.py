"""What numba has compiled for a guest, kept from start to start, without a way from one run to another.

numba's caches hold pickles, so only guests load them, and each start sees a view of its own: links that it can read
through and not write through, in its scratch folder. What a start compiles beyond them is kept if it was there before
the guest was given its first measurement: then nothing that was measured can be in it.
"""

from __future__ import annotations

import contextlib
import os
import shutil
from pathlib import Path

_MOST_FILES = 4096
_MOST_BYTES = 256 << 20
_MOST_VERSIONS = 4  # of a method's code


def lay_out(kept: Path, view: Path) -> None:
    """Links in `view` to all files in `kept`, folder by folder. Raises OSError."""
    view.mkdir(exist_ok=True)
    for folder, _, files in os.walk(kept):
        here = view / Path(folder).relative_to(kept)
        here.mkdir(exist_ok=True)
        for name in files:
            (here / name).symlink_to(Path(folder) / name)


def keep_new(view: Path, kept: Path) -> int:
    """Copy into `kept` what was compiled in `view`; returns how many files. What cannot be kept is compiled again.

    Followed are no links, and copied are plain files only, up to a bound; each appears whole, an index after its data.
    """
    new = sorted(_plain_files(view), key=lambda file: (file.suffix == ".nbi", file))
    if len(new) > _MOST_FILES or sum(file.lstat().st_size for file in new) > _MOST_BYTES:
        return 0
    copied = 0
    for file in new:
        place = kept / file.relative_to(view)
        partial = place.with_name(f".{place.name}.{os.getpid()}")
        with contextlib.suppress(OSError):
            if not kept.exists():
                _forget_older(kept)
            place.parent.mkdir(parents=True, exist_ok=True)
            source = os.open(file, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
            with os.fdopen(source, "rb") as reading, partial.open("xb") as writing:
                shutil.copyfileobj(reading, writing)
            partial.replace(place)
            copied += 1
    return copied


def _forget_older(kept: Path) -> None:
    """Of what was kept for the same method with other code, keep the youngest few."""
    name = kept.name.rpartition("-")[0]
    older = [folder for folder in kept.parent.glob(f"{name}-*") if folder.name.rpartition("-")[0] == name]
    for folder in sorted(older, key=lambda folder: folder.stat().st_mtime)[: -_MOST_VERSIONS + 1]:
        shutil.rmtree(folder, ignore_errors=True)


def _plain_files(folder: Path) -> list[Path]:
    found: list[Path] = []
    for place, _, files in os.walk(folder):
        plain = (Path(place) / name for name in files if Path(name).suffix in (".nbi", ".nbc"))
        found += [file for file in plain if not file.is_symlink() and file.is_file()]
    return found
