"""Options as the command line takes them: those that several commands have, and those of a method."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

WorldPath: TypeAlias = Annotated[
    list[Path] | None, typer.Option(help="Where your copy of the world lies; or TASKSLAM_WORLD_PATH.")
]
WorldPaths: TypeAlias = Annotated[
    list[Path] | None, typer.Option(help="Where your copies of the worlds lie; or TASKSLAM_WORLD_PATH.")
]


def parse_options(pairs: list[str]) -> dict[str, object]:
    """Method options from `key=value` pairs; values are read as YAML scalars, so 0.5 is a number and true a boolean.

    Raises:
        InputError: no `=`, or a value that is not YAML.
    """
    from taskslam.errors import InputError
    from taskslam.user_files import value_of

    options: dict[str, object] = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not key or not equals:
            raise InputError(f"--option {pair}: expected KEY=VALUE")
        options[key] = value_of(value, f"--option {pair}", InputError)
    return options
