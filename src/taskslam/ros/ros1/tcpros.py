"""TCPROS: how ROS 1 nodes send messages to one another, as bytes with their length before them, after a header each.

Source: wiki.ros.org/ROS/TCPROS and /ROS/Connection Header.
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Mapping

from taskslam.ros.errors import RosError

ANY = "*"  # md5sum and type of who takes every kind
_LENGTH = struct.Struct("<I")
_LONGEST_HEADER = 1 << 20
_LONGEST_MESSAGE = 256 << 20
_SHAKE_HANDS_S = 10.0

Header = dict[str, str]


def connect(host: str, port: int, header: Mapping[str, str]) -> tuple[socket.socket, Header]:
    """A connection to a publisher or a service, and the header that it answered.

    Raises RosError: nobody is there, or it refuses.
    """
    try:
        connection = socket.create_connection((host, port), timeout=_SHAKE_HANDS_S)
    except (OSError, OverflowError, UnicodeError) as error:
        raise RosError(f"{host}:{port}: {error}") from error
    try:
        at_once(connection)
        send(connection, packed(header))
        answer = receive_header(connection)
        if "error" in answer:
            raise RosError(answer["error"])
        connection.settimeout(None)
    except BaseException:
        connection.close()
        raise
    return connection, answer


def at_once(connection: socket.socket) -> None:
    """Send small messages without waiting for more (`tcp_nodelay`)."""
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)


def packed(header: Mapping[str, str]) -> bytes:
    """A header with its length."""
    fields = [f"{key}={value}".encode() for key, value in header.items()]
    return framed(b"".join(_LENGTH.pack(len(field)) + field for field in fields))


def framed(message: bytes | memoryview) -> bytes:
    """A message with its length."""
    return b"".join((_LENGTH.pack(len(message)), message))


def send(connection: socket.socket, data: bytes) -> None:
    """All of it. Raises RosError: the peer is gone, or takes nothing for longer than the connection waits."""
    try:
        connection.sendall(data)
    except OSError as error:
        raise RosError(str(error)) from error


def receive_header(connection: socket.socket) -> Header:
    """What the peer says of itself. Raises RosError."""
    data = receive_message(connection, _LONGEST_HEADER)
    header: Header = {}
    at = 0
    while at < len(data):
        if len(data) - at < _LENGTH.size:
            raise RosError("a connection header that ends within a field")
        (size,) = _LENGTH.unpack_from(data, at)
        at += _LENGTH.size
        key, equals, value = bytes(data[at : at + size]).partition(b"=")
        if not equals or len(data) - at < size:
            raise RosError("a connection header with a field that is no key=value")
        header[key.decode(errors="replace")] = value.decode(errors="replace")
        at += size
    return header


def receive_message(connection: socket.socket, longest: int = _LONGEST_MESSAGE) -> bytearray:
    """The next message. Raises RosError: the peer is gone, or declares more than `longest` bytes."""
    (size,) = _LENGTH.unpack(receive(connection, _LENGTH.size))
    if size > longest:
        raise RosError(f"a message that declares {size} bytes; expected at most {longest}")
    return receive(connection, size)


def receive(connection: socket.socket, size: int) -> bytearray:
    """So many bytes. Raises RosError: the peer is gone."""
    data = bytearray(size)
    view, got = memoryview(data), 0
    while got < size:
        try:
            count = connection.recv_into(view[got:])
        except OSError as error:
            raise RosError(str(error)) from error
        if not count:
            raise RosError("the peer has closed the connection")
        got += count
    return data


def differences(header: Header, kind: str, md5: str) -> str:
    """Why two ends of a topic do not fit; empty if they do."""
    theirs = header.get("md5sum", ANY)
    if theirs in (ANY, md5) or md5 == ANY:
        return ""
    return f"{header.get('callerid', 'a node')} has {header.get('type', '?')} [{theirs}]; expected {kind} [{md5}]"
