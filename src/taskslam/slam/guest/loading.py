"""Loading a method's code: done in the processes of methods, and nowhere else (design D12)."""

from __future__ import annotations

import importlib

from taskslam.errors import InputError, MethodUnavailableError
from taskslam.slam.base import MethodCard, SlamMethod
from taskslam.slam.registry import absent, find_method, one_line


def load_method(name: str) -> type[SlamMethod]:
    """The class behind a name. It is imported: only a confined process calls this.

    Raises:
        UnknownMethodError: no such method.
        MethodUnavailableError: a package that it needs is not installed; names the extra.
        InputError: what the name leads to cannot be imported, or is not a SLAM method with a card.
    """
    entry = find_method(name)
    module_name, _, class_name = entry.target.partition(":")
    try:
        found = getattr(importlib.import_module(module_name), class_name)
    except ModuleNotFoundError as error:
        missing = error.name or str(error)
        if module_name == missing or module_name.startswith(f"{missing}."):
            raise InputError(f"method '{name}': there is no module '{missing}' ({entry.target})") from error
        raise MethodUnavailableError(absent(entry, missing, None)) from error
    except AttributeError as error:
        raise InputError(f"method '{name}': module '{module_name}' has no class '{class_name}'") from error
    except (Exception, SystemExit) as error:
        raise InputError(f"method '{name}': importing {module_name} failed: {one_line(error)}") from error
    if entry.argument:
        found = found(entry.argument)
    if not (isinstance(found, type) and issubclass(found, SlamMethod)):
        raise InputError(f"method '{name}': {entry.target} is not a subclass of taskslam.slam.SlamMethod")
    if not isinstance(getattr(found, "card", None), MethodCard):
        raise InputError(f"method '{name}': {entry.target} has no `card = MethodCard(...)`")
    return found
