"""System libraries that pyorbslam3's wheel takes for granted, and the Debian packages that bring them."""

from __future__ import annotations

import ctypes

# As `ldd` names them, beyond the C and C++ runtimes; the viewer that needs them is never opened.
LIBRARIES = {
    "libOpenGL.so.0": "libopengl0",
    "libGLX.so.0": "libglx0",
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libX11.so.6": "libx11-6",
    "libXext.so.6": "libxext6",
    "libSM.so.6": "libsm6",
    "libICE.so.6": "libice6",
}


def missing_libraries() -> list[str]:
    """Those of `LIBRARIES` that the dynamic linker does not find."""
    return [library for library in LIBRARIES if not _loads(library)]


def install_command(libraries: list[str]) -> str:
    """The command that brings libraries on Debian and Ubuntu."""
    return "apt install " + " ".join(LIBRARIES[library] for library in libraries)


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True
