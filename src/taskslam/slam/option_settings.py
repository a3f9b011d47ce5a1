"""A method's keyword options, read into its settings model with errors that name the method and the option."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from taskslam.errors import InputError, did_you_mean
from taskslam.user_files import complaint

Model = TypeVar("Model", bound=BaseModel)


def read_options(model: type[Model], method: str, options: Mapping[str, object]) -> Model:
    """Settings of a method from its options; what is not given keeps its default.

    Raises:
        InputError: an unknown option (with the nearest known name) or a value out of range.
    """
    check_option_names(method, options, model.model_fields)
    try:
        return model.model_validate(dict(options))
    except ValidationError as error:
        raise InputError(f"{method} option {complaint(error, model)}") from error


def check_option_names(method: str, options: Collection[str], known: Collection[str]) -> None:
    """Refuse options that nobody would read. Raises InputError: one is not among the known; names the nearest."""
    for name in options:
        if name not in known:
            raise InputError(f"{method} has no option '{name}'.{did_you_mean(name, known)} Known: {', '.join(known)}")
