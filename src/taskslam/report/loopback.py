"""A page served to the browser of the person at this machine, and to nobody else.

    with LoopbackServer(page, acts) as server:
        print(server.url)
        server.serve_forever()

It listens on the loopback interface alone. Its address holds a word that nobody else knows, and a request from a page
of another origin, or under another name of this machine, is refused: other pages in the browser and other users of
the machine cannot ask what they cannot name.
"""

from __future__ import annotations

import json
import secrets
from collections.abc import Callable, Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from taskslam.errors import TaskSlamError
from taskslam.version import __version__

_LOOPBACK = "127.0.0.1"
_LONGEST = 1 << 20  # bytes of a request
_PATIENCE_S = 10.0

Act = Callable[[bytes], Mapping[str, Any]]


class LoopbackServer(ThreadingHTTPServer):
    """Serves `page` at `url`, and answers what its script posts beside it: `acts` by name, JSON in and out.

    An act's TaskSlamError is told to the page, as {"error": sentence}. port: 0 for any that is free.
    """

    daemon_threads = True

    def __init__(self, page: Callable[[], str], acts: Mapping[str, Act], port: int = 0) -> None:
        super().__init__((_LOOPBACK, port), _Handler)
        self.page, self.acts = page, acts
        self.word = secrets.token_urlsafe(16)
        self.origin = f"http://{_LOOPBACK}:{self.server_port}"

    @property
    def url(self) -> str:
        """Where the page is."""
        return f"{self.origin}/{self.word}/"


class _Handler(BaseHTTPRequestHandler):
    server: LoopbackServer
    server_version = f"taskslam/{__version__}"
    sys_version = ""
    timeout = _PATIENCE_S

    def do_GET(self) -> None:
        """The page."""
        if self._is_ours() and self.path == f"/{self.server.word}/":
            self._answer(HTTPStatus.OK, "text/html; charset=utf-8", self.server.page().encode())
        else:
            self._refuse()

    def do_POST(self) -> None:
        """What the page asks for."""
        act = self.server.acts.get(self.path.removeprefix(f"/{self.server.word}/"))
        length = self.headers.get("Content-Length", "")
        if not self._is_ours() or act is None or self.headers.get("Origin", self.server.origin) != self.server.origin:
            self._refuse()
        elif not length.isdecimal() or int(length) > _LONGEST:
            self._answer_json(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, {"error": "more than a page of ours says"})
        else:
            try:
                self._answer_json(HTTPStatus.OK, act(self.rfile.read(int(length))))
            except TaskSlamError as error:
                self._answer_json(HTTPStatus.BAD_REQUEST, {"error": str(error)})

    def _is_ours(self) -> bool:
        return self.headers.get("Host") == self.server.origin.removeprefix("http://")

    def _refuse(self) -> None:
        self._answer(HTTPStatus.NOT_FOUND, "text/plain; charset=utf-8", b"There is nothing here.\n")

    def _answer_json(self, status: HTTPStatus, content: Mapping[str, Any]) -> None:
        self._answer(status, "application/json", json.dumps(content, allow_nan=False).encode())

    def _answer(self, status: HTTPStatus, kind: str, body: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        """Say nothing."""
