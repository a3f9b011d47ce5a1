"""A process that is killed before its next file operation, and the next, and the next: what is left each time?"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from itertools import count

_TOUCHES_FILES = ("open", "os.", "shutil.")
_KILLED = 137


def killed_at_every_step(act: Callable[[int], None]) -> Iterator[int]:
    """Call `act(n)` in a process that ends before its n-th file operation, for n from 0 on; yields n after each.

    The last n is that of a process which came to its end.
    """
    for number in count():
        child = os.fork()
        if child == 0:
            _die_before(number)
            try:
                act(number)
                os._exit(0)
            finally:
                os._exit(1)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        assert status in (0, _KILLED), f"the process failed before its operation {number} with status {status}"
        yield number
        if status == 0:
            return


def _die_before(number: int) -> None:
    left = [number]

    def look(event: str, _: object) -> None:
        if event.startswith(_TOUCHES_FILES):
            if not left[0]:
                os._exit(_KILLED)
            left[0] -= 1

    sys.addaudithook(look)
