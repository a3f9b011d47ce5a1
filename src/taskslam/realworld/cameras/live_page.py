"""A page on this computer alone that shows what a recording sees. Nothing is sent anywhere else."""

from __future__ import annotations

import html
import json
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from taskslam.errors import InputError

LOOPBACK = "127.0.0.1"

_PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title>
<style>body{{font:16px/1.5 system-ui,sans-serif;margin:1.5rem;color:#1c2430}}img{{max-width:100%;background:#eef0f3}}
p{{font-variant-numeric:tabular-nums}}b.warning{{color:#b84a00}}</style>
<p><b>{title}</b> <span id="status"></span><br><b class="warning" id="warning"></b></p><img id="picture" alt="">
<script>
const picture = document.getElementById("picture");
async function look() {{
  try {{
    const status = await (await fetch("status.json")).json();
    document.getElementById("status").textContent = status.text;
    document.getElementById("warning").textContent = status.warning;
    picture.src = "picture.jpg?" + status.number;
  }} catch {{ document.getElementById("status").textContent = "the recording has ended"; }}
}}
look(); setInterval(look, 500);
</script></html>
"""


class Preview:
    """Serves the newest picture and a line of text on the loopback address; a context manager. port: 0 for any.

    Raises:
        InputError: the port is taken.
    """

    def __init__(self, title: str, port: int = 0) -> None:
        self._lock = threading.Lock()
        self._picture, self._status = b"", {"text": "", "warning": "", "number": 0}
        self._page = _PAGE.format(title=html.escape(title)).encode()
        preview = self

        class Handler(BaseHTTPRequestHandler):
            timeout = 10

            def do_GET(self) -> None:
                preview._answer(self)

            def log_message(self, *_: Any) -> None:
                pass

        try:
            self._server = ThreadingHTTPServer((LOOPBACK, port), Handler)
        except (OSError, OverflowError) as error:
            raise InputError(f"preview port {port}: cannot be used ({error}); name another, or 0 for any") from error
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.2,), daemon=True)
        self._thread.start()

    def __enter__(self) -> Preview:
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._server.server_close()

    @property
    def url(self) -> str:
        """Where to look."""
        return f"http://{LOOPBACK}:{self._server.server_address[1]}/"

    def show(self, picture: bytes | None, text: str, warning: str = "") -> None:
        """Show a JPEG (None leaves the last) with a line of text and a warning."""
        with self._lock:
            number = int(self._status["number"]) + (picture is not None)  # type: ignore[call-overload]
            self._picture = self._picture if picture is None else picture
            self._status = {"text": text, "warning": warning, "number": number}

    def _answer(self, request: BaseHTTPRequestHandler) -> None:
        # A web page elsewhere that points its own name at the loopback address must not look on.
        host = request.headers.get("Host", "").rsplit(":", 1)[0]
        with self._lock:
            found = {
                "/": ("text/html; charset=utf-8", self._page),
                "/status.json": ("application/json", json.dumps(self._status).encode()),
                "/picture.jpg": ("image/jpeg", self._picture),
            }.get(request.path.partition("?")[0])
        if host not in (LOOPBACK, "localhost") or found is None or not found[1]:
            request.send_error(404)
            return
        request.send_response(200)
        request.send_header("Content-Type", found[0])
        request.send_header("Content-Length", str(len(found[1])))
        request.send_header("Cache-Control", "no-store")
        request.end_headers()
        request.wfile.write(found[1])
