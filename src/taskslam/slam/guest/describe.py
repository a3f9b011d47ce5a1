"""A process that says what methods are, the module run with arguments REQUEST_FD REPLY_FD: their cards, and no more.

It is asked for some methods by name, and answers one after the other: a method whose code ends the process is the one
that has no answer. Started by `cards.py` behind the same wall as the methods themselves.
"""

from __future__ import annotations

import dataclasses
import os
import sys

from taskslam.errors import InputError, MethodUnavailableError
from taskslam.processes import messages
from taskslam.slam.guest.loading import load_method
from taskslam.slam.registry import one_line


def main(arguments: list[str]) -> None:
    """Describe the methods that one request names."""
    request, reply = (int(argument) for argument in arguments)
    for descriptor in (request, reply):
        os.set_inheritable(descriptor, False)
    reader = messages.MessageReader()
    while chunk := os.read(request, 1 << 16):
        for header, _ in reader.messages(chunk):
            for name in header["describe"]:
                rest = memoryview(messages.pack({"method": name, **_described(name)}))
                while rest:
                    rest = rest[os.write(reply, rest) :]
            return


def _described(name: str) -> dict[str, object]:
    try:
        return {"card": dataclasses.asdict(load_method(name).card)}
    except MethodUnavailableError as error:
        return {"problem": str(error), "unavailable": True}
    except InputError as error:
        return {"problem": str(error)}
    except BaseException as error:  # a card that is no plain value, or an exit of the method's own
        return {"problem": f"method '{name}': it cannot be described: {one_line(error)}"}


if __name__ == "__main__":
    main(sys.argv[1:])
