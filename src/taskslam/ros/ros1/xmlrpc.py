"""XML-RPC as ROS 1 has it: every answer is [code, words, value]; servers on this machine alone, clients that give up.

Source: ROS master and slave APIs (wiki.ros.org/ROS/Master_API, /ROS/Slave_API).
"""

from __future__ import annotations

import http.client
import threading
import xmlrpc.client
from collections.abc import Mapping
from socketserver import ThreadingMixIn
from typing import Any, Protocol
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

from taskslam.ros.errors import RosError

HERE = "127.0.0.1"
_PATIENCE_S = 10.0
_SUCCESS, _FAILURE = 1, -1


class Api(Protocol):
    """What a server offers. The functions take positional arguments; a RosError becomes a failure with its words."""

    def functions(self) -> Mapping[str, Any]:
        """By their names in the API."""


class Server:
    """Serves an API on a port of its own, at one address of this machine. uri: where."""

    def __init__(self, api: Api, host: str = HERE) -> None:
        self._server = _Threaded((host, 0), _Handler, logRequests=False, allow_none=True)
        self._server.register_instance(_Dispatcher(api.functions()))
        self.uri = f"http://{host}:{self._server.server_address[1]}/"
        threading.Thread(target=self._server.serve_forever, args=(0.05,), name="xmlrpc", daemon=True).start()

    def close(self) -> None:
        """Serve no more."""
        self._server.shutdown()
        self._server.server_close()


def call(uri: str, function: str, *arguments: Any) -> Any:
    """The value that a peer answers. Raises RosError: it is gone, hangs, or refuses."""
    try:
        with xmlrpc.client.ServerProxy(uri, transport=_GivesUp(), allow_none=True) as proxy:
            answer = getattr(proxy, function)(*arguments)
            code, words, value = answer
    except (OSError, http.client.HTTPException, xmlrpc.client.Error, ValueError, TypeError, SyntaxError) as error:
        raise RosError(f"{function} at {uri}: {error}") from error
    except Exception as error:  # expat's, on what is no XML
        raise RosError(f"{function} at {uri}: not an answer: {error}") from error
    if code != _SUCCESS:
        raise RosError(f"{function} at {uri}: {words}")
    return value


class _GivesUp(xmlrpc.client.Transport):
    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = _PATIENCE_S
        return connection


class _Threaded(ThreadingMixIn, SimpleXMLRPCServer):
    daemon_threads = True
    block_on_close = False

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A peer that went away in the middle is no news."""


class _Handler(SimpleXMLRPCRequestHandler):
    rpc_paths = ()
    timeout = 60.0


class _Dispatcher:
    def __init__(self, functions: Mapping[str, Any]) -> None:
        self._functions = functions

    def _dispatch(self, function: str, arguments: tuple[Any, ...]) -> list[Any]:
        called = self._functions.get(function)
        if called is None:
            return [_FAILURE, f"there is no {function}", 0]
        try:
            return [_SUCCESS, "", called(*arguments)]
        except RosError as error:
            return [_FAILURE, str(error), 0]
        except (TypeError, ValueError, LookupError, AttributeError) as error:
            return [_FAILURE, f"{function} cannot take {len(arguments)} such arguments: {error}", 0]
