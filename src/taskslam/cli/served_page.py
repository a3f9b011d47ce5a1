"""A page that a command serves to the person at this machine, until Ctrl-C."""

from __future__ import annotations

import webbrowser
from typing import TYPE_CHECKING, Protocol

from taskslam.cli.console import say

if TYPE_CHECKING:
    from collections.abc import Mapping

    from taskslam.report.loopback import Act


class ServedPage(Protocol):
    """A page, and what its script may ask for, by name."""

    def page(self) -> str:
        """The page."""

    @property
    def acts(self) -> Mapping[str, Act]:
        """What is answered."""


def serve_page(page: ServedPage, port: int, browser: bool, end: str) -> None:
    """Serve it on `port`, 0 for any that is free. browser: open it there. end: what Ctrl-C means, for the person.

    Raises InputError if the port cannot be had.
    """
    from taskslam.errors import InputError
    from taskslam.report.loopback import LoopbackServer

    try:
        server = LoopbackServer(page.page, page.acts, port)
    except OSError as error:
        raise InputError(f"--port {port}: {error.strerror}; expected a free one, or 0") from error
    with server:
        say(f"{server.url}  (Ctrl-C ends it{end})")
        if browser:
            webbrowser.open(server.url)
        server.serve_forever()
