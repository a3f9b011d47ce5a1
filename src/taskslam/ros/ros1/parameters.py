"""The parameter server's tree: values by whole names, folders as mappings."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from taskslam.ros.errors import RosError


class Parameters:
    """A tree of parameters. Names are whole, as /node/name; what is set to a mapping is a folder."""

    def __init__(self) -> None:
        self._root: dict[str, Any] = {}

    def set(self, name: str, value: Any) -> None:
        """Set a value, or a whole folder, in place of what was there."""
        *way, last = _parts(name) or [""]
        if not last:
            if not isinstance(value, dict):
                raise RosError("the root of all parameters is a folder; expected a mapping")
            self._root = value
            return
        folder = self._root
        for part in way:
            below = folder.get(part)
            if not isinstance(below, dict):
                below = folder[part] = {}
            folder = below
        folder[last] = value

    def get(self, name: str) -> Any:
        """A value or a folder. Raises RosError: there is none."""
        found: Any = self._root
        for part in _parts(name):
            if not isinstance(found, dict) or part not in found:
                raise RosError(f"Parameter [{name}] is not set")
            found = found[part]
        return found

    def has(self, name: str) -> bool:
        """Whether there is such a value or folder."""
        try:
            self.get(name)
        except RosError:
            return False
        return True

    def delete(self, name: str) -> None:
        """Take it away. Raises RosError: there is none."""
        *way, last = _parts(name)
        folder = self.get("/" + "/".join(way))
        if not isinstance(folder, dict) or last not in folder:
            raise RosError(f"Parameter [{name}] is not set")
        del folder[last]

    def search(self, node: str, key: str) -> str:
        """The name nearest to a node, from its own namespace up, whose first part is there. Raises RosError."""
        if key.startswith("/"):
            if self.has(key):
                return key
        else:
            first, spaces = _parts(key)[0], _parts(node)
            for depth in range(len(spaces), -1, -1):
                space = "".join(f"/{part}" for part in spaces[:depth])
                if self.has(f"{space}/{first}"):
                    return f"{space}/{key}"
        raise RosError(f"Cannot find parameter [{key}] in an upwards search")

    def names(self) -> list[str]:
        """Of all values."""
        return list(_names(self._root, ""))


def _parts(name: str) -> list[str]:
    return [part for part in name.split("/") if part]


def _names(folder: dict[str, Any], above: str) -> Iterator[str]:
    for key, value in folder.items():
        name = f"{above}/{key}"
        if isinstance(value, dict):
            yield from _names(value, name)
        else:
            yield name
