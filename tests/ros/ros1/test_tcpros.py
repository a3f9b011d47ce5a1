import contextlib
import socket
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from taskslam.ros.errors import RosError
from taskslam.ros.ros1 import tcpros

KEYS = st.text(st.characters(min_codepoint=32, max_codepoint=126, exclude_characters="="), min_size=1, max_size=20)
HEADERS = st.dictionaries(KEYS, st.text(st.characters(exclude_categories=["Cs"]), max_size=50), max_size=6)


def through(data, read):
    """What `read` makes of bytes that a peer sends before it closes."""
    one, other = socket.socketpair()
    with one, other:
        one.sendall(data)
        one.shutdown(socket.SHUT_WR)
        return read(other)


@given(HEADERS)
def test_a_header_arrives_as_it_was_sent(header):
    assert through(tcpros.packed(header), tcpros.receive_header) == header


@given(st.binary(max_size=300))
def test_any_bytes_are_a_header_or_refused_in_words(data):
    with contextlib.suppress(RosError):
        assert isinstance(through(data, tcpros.receive_header), dict)


@given(HEADERS.filter(bool), st.data())
def test_a_header_that_is_cut_off_is_refused(header, data):
    whole = tcpros.packed(header)
    cut = data.draw(st.integers(0, len(whole) - 1))
    with pytest.raises(RosError):
        through(whole[:cut], tcpros.receive_header)


def test_a_message_that_declares_gigabytes_is_refused_before_any_is_allocated():
    with pytest.raises(RosError, match="declares 4294967295 bytes"):
        through(b"\xff\xff\xff\xff", tcpros.receive_message)


def test_messages_arrive_in_order_however_they_are_cut():
    messages = [bytes([index]) * (index * 1000) for index in range(20)]
    one, other = socket.socketpair()
    got = []
    reader = threading.Thread(target=lambda: got.extend(bytes(tcpros.receive_message(other)) for _ in messages))
    reader.start()
    with one, other:
        stream = b"".join(map(tcpros.framed, messages))
        for at in range(0, len(stream), 777):
            one.sendall(stream[at : at + 777])
        reader.join(10)
    assert got == messages


def test_nobody_there_is_said():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    with pytest.raises(RosError, match=f"127.0.0.1:{port}: .*refused"):
        tcpros.connect("127.0.0.1", port, {})
