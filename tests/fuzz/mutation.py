"""Bytes damaged as disks, editors and attackers do it. The same dice give the same damage."""

from __future__ import annotations

import io
import random
import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Sequence

LARGEST = 1 << 18  # bytes; what grows stops here
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_WORD = re.compile(rb"[A-Za-z_][\w./:-]{1,30}")

_NUMBERS = [
    b"0", b"-1", b"1", b"2", b"255", b"256", b"65536", b"1000000", b"4000000000", b"2147483648", b"-2147483649",
    b"9223372036854775807", b"9223372036854775808", b"-9223372036854775808", b"18446744073709551616", b"9e18", b"1e300",
    b"-1e300", b"1e309", b"1e-300", b"1e999999", b"nan", b"NaN", b"-inf", b".inf", b"Infinity", b"0.5", b"-0.0", b"1.5",
    b"9" * 400, b"9" * 5000, b"0x1F", b"1_000", b"1,5", b"true", b"null", b'""', b"[]", b"{}",
]  # fmt: skip
_STRANGE = [
    b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\xed\xa0\x80", b"\xf4\x90\x80\x80", b"\x1b[31m", b"\xe2\x80\xae", b"\r",
    b"\n",     b"[" * 5000, b"{" * 5000, b"(" * 5000, b"<a>" * 2000, b"&a [*a]", b"<<: *a", b"!!python/name:os.system",
    b"- " * 300,     b"%YAML:1.0\n", b"#", b"%", b",", b":", b"..", b"../../../etc/passwd", b"/dev/zero", b"*", b"**", b"~", b"$HOME",
]  # fmt: skip
_BINARY = [
    struct.pack(order + kind, value)
    for order in "<>"
    for kind, values in (
        ("B", (0, 1, 127, 128, 255)),
        ("H", (0, 1, 32767, 65535)),
        ("I", (0, 1, 1 << 16, 1 << 24, (1 << 31) - 1, 1 << 31, (1 << 32) - 1)),
        ("Q", (0, 1, 1 << 31, 1 << 32, 1 << 40, (1 << 63) - 1, 1 << 63, (1 << 64) - 1)),
        ("f", (0.0, -1.0, 1e38, float("nan"), float("inf"))),
        ("d", (0.0, -1.0, 1e300, float("nan"), float("-inf"))),
    )
    for value in values
]


def damaged(data: bytes, others: Sequence[bytes], dice: random.Random) -> bytes:
    """The data with one to four kinds of damage. others: examples of which parts may be spliced in."""
    for _ in range(dice.choice((1, 1, 1, 2, 2, 4))):
        data = dice.choice(_WAYS)(data, others, dice)[:LARGEST]
    return data


def damaged_inside(name: str, data: bytes, others: Sequence[bytes], dice: random.Random) -> bytes:
    """As `damaged`, but with checksums that are right, half of the time, so that the damage is read and not refused."""
    if dice.random() < 0.5:
        if name.endswith(".npz"):
            return _archive_with_damage(data, others, dice)
        if data.startswith(b"\x89PNG"):
            return _summed_png(damaged(data, others, dice))
    return damaged(data, others, dice)


def _span(data: bytes, dice: random.Random) -> tuple[int, int]:
    begin = dice.randrange(len(data) + 1)
    return begin, min(len(data), begin + int(2 ** dice.uniform(0, 12)))


def _flip(data: bytes, _: Sequence[bytes], dice: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(dice.choice((1, 1, 3, 20)) if changed else 0):
        changed[dice.randrange(len(changed))] ^= 1 << dice.randrange(8)
    return bytes(changed)


def _cut_off(data: bytes, _: Sequence[bytes], dice: random.Random) -> bytes:
    return data[: dice.randrange(len(data) + 1)]


def _remove(data: bytes, _: Sequence[bytes], dice: random.Random) -> bytes:
    begin, end = _span(data, dice)
    return data[:begin] + data[end:]


def _repeat(data: bytes, _: Sequence[bytes], dice: random.Random) -> bytes:
    begin, end = _span(data, dice)
    return data[:end] + data[begin:end] * dice.choice((1, 1, 1, 2, 2, 3, 5, 10, 30, 100, 1000, 50_000)) + data[end:]


def _text_number(data: bytes, _: Sequence[bytes], dice: random.Random) -> bytes:
    found = list(_NUMBER.finditer(data[:20_000]))
    if not found:
        return _binary_number(data, _, dice)
    at = dice.choice(found)
    return data[: at.start()] + dice.choice(_NUMBERS) + data[at.end() :]


def _binary_number(data: bytes, _: Sequence[bytes], dice: random.Random) -> bytes:
    number = dice.choice(_BINARY)
    at = dice.randrange(len(data) + 1)
    return data[:at] + number + data[at + len(number) :]


def _splice(data: bytes, others: Sequence[bytes], dice: random.Random) -> bytes:
    other = dice.choice(others)
    begin, end = _span(other, dice)
    at, until = _span(data, dice)
    return data[:at] + other[begin:end] + data[dice.choice((at, until)) :]


def _word(data: bytes, others: Sequence[bytes], dice: random.Random) -> bytes:
    mine, theirs = list(_WORD.finditer(data[:20_000])), _WORD.findall(dice.choice(others)[:20_000])
    if not mine or not theirs:
        return _splice(data, others, dice)
    at = dice.choice(mine)
    return data[: at.start()] + dice.choice(theirs) + data[at.end() :]


def _strange(data: bytes, _: Sequence[bytes], dice: random.Random) -> bytes:
    at = dice.randrange(len(data) + 1)
    return data[:at] + dice.choice(_STRANGE) + data[at:]


def _lines(data: bytes, _: Sequence[bytes], dice: random.Random) -> bytes:
    lines = data.split(b"\n")
    one, two = dice.randrange(len(lines)), dice.randrange(len(lines))
    match dice.randrange(3):
        case 0:
            lines[one], lines[two] = lines[two], lines[one]
        case 1:
            lines.insert(two, lines[one])
        case _:
            del lines[one]
    return b"\n".join(lines)


_WAYS: tuple[Callable[[bytes, Sequence[bytes], random.Random], bytes], ...] = (
    _flip, _cut_off, _remove, _repeat, _text_number, _text_number, _binary_number, _splice, _word, _strange, _lines,
)  # fmt: skip


def _archive_with_damage(data: bytes, others: Sequence[bytes], dice: random.Random) -> bytes:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    name = dice.choice(sorted(parts))
    header = 10 + int.from_bytes(parts[name][8:10], "little")
    if dice.random() < 0.5:  # the values alone, as many as there were
        values = damaged(parts[name][header:], list(parts.values()), dice)
        size = len(parts[name]) - header
        parts[name] = parts[name][:header] + values[:size].ljust(size, b"\0")
    else:
        parts[name] = damaged(parts[name], list(parts.values()), dice)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", dice.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))) as archive:
        for key, content in parts.items():
            archive.writestr(key, content)
    return buffer.getvalue()


def _summed_png(data: bytes) -> bytes:
    """The chunks of a PNG with the checksums that they should have, as far as they can be followed."""
    out, at = data[:8], 8
    while at + 12 <= len(data):
        size = int.from_bytes(data[at : at + 4], "big")
        body = data[at + 4 : at + 8 + size]
        out += data[at : at + 4] + body + zlib.crc32(body).to_bytes(4, "big")
        at += 12 + size
    return out + data[at:]
