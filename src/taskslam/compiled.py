"""Loops compiled by numba. Their machine code is kept on disk where that can be, and costs nothing but time elsewhere.

numba refuses to import a function whose cache has no place that can be written, and raises where a disk is full or a
cache is damaged. Here each of these means: compile again.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any

import numba
from numba.core.caching import FunctionCache
from numba.core.ccallback import CFunc


class _Cache(FunctionCache):  # type: ignore[misc]  # numba is untyped
    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # whatever unpickling meets in a damaged file
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        with contextlib.suppress(Exception):  # the disk's errors, and what it meets in a damaged index
            super().save_overload(sig, data)


def njit(cache: bool = True, **options: Any) -> Callable[[Any], Any]:
    """`numba.njit` with these options. cache: whether to keep the machine code on disk, where that can be."""

    def compiled(function: Any) -> Any:
        dispatcher = numba.njit(**options)(function)
        if cache:
            with contextlib.suppress(RuntimeError):  # no place for it
                dispatcher._cache = _Cache(function)  # what `enable_caching` does
        return dispatcher

    return compiled


def cfunc(signature: Any) -> Callable[[Any], Any]:
    """`numba.cfunc` of a signature: a function that C can call, its machine code kept on disk where that can be."""

    def compiled(function: Any) -> Any:
        callback: Any = CFunc(function, (signature.args, signature.return_type), {}, {})
        with contextlib.suppress(RuntimeError):  # no place for it
            callback._cache = _Cache(function)
        callback.compile()
        return callback

    return compiled
