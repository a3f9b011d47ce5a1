"""Frames to an MP4 or a GIF, by the ffmpeg that the package imageio-ffmpeg ships."""

from __future__ import annotations

import contextlib
import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from taskslam.errors import DiskFullError, InputError
from taskslam.files import whole_file
from taskslam.report.film import Film

_ENCODERS: dict[str, dict[str, Any]] = {
    ".mp4": {"codec": "libx264", "pix_fmt_out": "yuv420p", "output_params": ["-crf", "20", "-movflags", "+faststart"]},
    ".gif": {
        "codec": "gif",
        "pix_fmt_out": "pal8",
        "output_params": ["-vf", "split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1:dither=bayer"],
    },
}
SUFFIXES = tuple(_ENCODERS)


def shipped_encoder() -> Any:
    """imageio-ffmpeg. Raises InputError if it is not installed."""
    try:
        return importlib.import_module("imageio_ffmpeg")
    except ImportError as error:
        raise InputError("a film needs the encoder of imageio-ffmpeg: pip install 'taskslam[film]'") from error


def write_film(film: Film, out: Path, fps: int, wrote: Callable[[int], None]) -> None:
    """Write all frames, whole or not at all; a file that stands there is replaced. wrote: hears how many there are.

    out: its suffix, .mp4 or .gif, says the form. Raises DiskFullError, and InputError as `shipped_encoder`.
    """
    encoder = shipped_encoder()
    with whole_file(out) as temporary:
        writer = encoder.write_frames(
            str(temporary), film.size, fps=fps, quality=None, macro_block_size=2, ffmpeg_log_level="error",
            **_ENCODERS[out.suffix],
        )  # fmt: skip
        try:
            with contextlib.closing(writer):
                writer.send(None)
                for number, frame in enumerate(film.frames(), start=1):
                    writer.send(frame.tobytes())
                    wrote(number)
        except OSError as error:  # what ffmpeg said before it closed its pipe
            last = (str(error).strip().splitlines() or ["it ended early"])[-1]
            raise DiskFullError(f"{out}: the film could not be written: {last.strip():.200}") from error
