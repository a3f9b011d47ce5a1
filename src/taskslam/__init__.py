"""TaskSLAM-Bench: SLAM inside the navigation loop, and how repeatably the robot arrives.

What `import taskslam` gives is listed in `__all__`, lives in `taskslam.api` and is shown in docs/python.md. It is
loaded when it is first used, so that the command line answers at once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from taskslam.version import __version__

if TYPE_CHECKING:
    from taskslam.api import Results, RunSpec, Table, compare, evaluate, load, run, tour, trajectories

__all__ = [
    "Results", "RunSpec", "Table", "__version__", "compare", "evaluate", "load", "run", "tour",
    "trajectories",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name in __all__:
        from taskslam import api

        return getattr(api, name)
    raise AttributeError(f"module 'taskslam' has no attribute '{name}'; it has {', '.join(__all__)}")


def __dir__() -> list[str]:
    return __all__
