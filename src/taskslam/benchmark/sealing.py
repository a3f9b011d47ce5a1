"""Sealed runs: noise that nobody can guess while a method runs, and anybody can repeat afterwards (design D12).

Every noise stream of a sealed run is salted with an HMAC of a secret and the run's hash. The secret rests beside the
results, where the wall around methods keeps it, so that what was interrupted goes on with the same noise; once all is
driven it is deleted. run.json holds the salt, from which the secret cannot be had: a finished run tells nothing about
those to come. Sealing guards against the method, not against the person who drives it.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import re
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from taskslam.errors import InputError, RecordError
from taskslam.files import write_once
from taskslam.processes import landlock

_FILE = ".taskslam-seal"
_BYTES = 32
_SALT = re.compile(r"[0-9a-f]{64}")


@dataclass
class Seal:
    """keep: whether the secret stays when this is over, as where a run must be tried again."""

    keep: bool = False


@contextmanager
def sealed(out: Path, wanted: bool = True) -> Iterator[Seal]:
    """While runs are sealed with the secret of `out`; it is deleted when all went well, and kept for the next try else.

    Raises:
        InputError: there is no working wall here, so that a method could read the secret.
    """
    seal = Seal()
    if not wanted:
        yield seal
        return
    if not landlock.is_available():
        raise InputError(
            "--sealed: this kernel has no Landlock, so that nothing keeps a method from reading the secret; expected"
            " Linux 5.13 or later with Landlock switched on (taskslam doctor)"
        )
    _secret(out)
    yield seal
    if not seal.keep:
        forget_secret(out)


def forget_secret(out: Path) -> None:
    """Delete the secret of `out`, if there is one: all is driven."""
    with suppress(OSError):
        (out / _FILE).unlink()


def seal_file(out: Path) -> Path:
    """Where the secret of the runs under `out` rests."""
    return out / _FILE


def salt_of(out: Path, digest: str) -> str:
    """The salt, 64 hexadecimal digits, of the run of this hash among those under `out`.

    Raises:
        RecordError: something else stands where the secret should. DiskFullError.
    """
    return hmac.new(_secret(out), digest.encode(), hashlib.sha256).hexdigest()


def checked_salt(text: str) -> str:
    """A salt as a person gives it. Raises InputError."""
    if not _SALT.fullmatch(text):
        raise InputError(f"salt '{text:.80}': expected 64 hexadecimal digits, as run.json of a sealed run holds them")
    return text


def told_apart(salt: str | None) -> str:
    """A word that tells the noise of a sealed run from another's, and from which its salt cannot be had."""
    return "" if salt is None else hashlib.sha256(salt.encode()).hexdigest()


def salted(seed: int, salt: str | None) -> int:
    """What all noise streams of a run begin with: the seed itself, or of a sealed run a number of 256 bits."""
    if salt is None:
        return seed
    return int.from_bytes(hmac.new(bytes.fromhex(salt), str(seed).encode(), hashlib.sha256).digest())


def _secret(out: Path) -> bytes:
    file = out / _FILE
    write_once(file, secrets.token_bytes(_BYTES), mode=0o600)
    try:
        with os.fdopen(os.open(file, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK), "rb") as kept:
            secret = kept.read(_BYTES + 1)
    except OSError as error:
        raise RecordError(f"{file}: the secret of sealed runs cannot be read: {error.strerror}") from None
    if len(secret) != _BYTES:
        raise RecordError(f"{file}: expected the secret of sealed runs, {_BYTES} bytes; delete it to drive them anew")
    return secret
