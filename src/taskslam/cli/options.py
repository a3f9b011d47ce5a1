"""Options of a method as the command line takes them."""

from __future__ import annotations


def parse_options(pairs: list[str]) -> dict[str, object]:
    """Method options from `key=value` pairs; values are read as YAML scalars, so 0.5 is a number and true a boolean.

    Raises:
        InputError: no `=`, or a value that is not YAML.
    """
    import yaml

    from taskslam.errors import InputError

    options: dict[str, object] = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not key or not equals:
            raise InputError(f"--option {pair}: expected KEY=VALUE")
        try:
            options[key] = yaml.safe_load(value)
        except yaml.YAMLError as error:
            raise InputError(f"--option {pair}: the value is not valid YAML") from error
    return options
