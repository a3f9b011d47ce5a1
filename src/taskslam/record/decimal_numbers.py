"""Decimal text to binary numbers in compiled code: the same doubles as Python's `float`, and integers without rounding.

Doubles: the algorithm of D. Lemire, "Number parsing at a gigabyte per second" (Software: Practice and Experience 51,
2021), with 128-bit powers of five. What it does not decide (more than 19 digits, huge exponents, subnormal numbers,
`nan`, `inf`) is left to the caller, who has `float`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from taskslam.compiled import njit

Bytes = npt.NDArray[Any]  # uint8; mypy would make of its elements what numba does not

_LOWEST, _HIGHEST = -300, 300


def _powers_of_five() -> npt.NDArray[np.uint64]:
    """(P, 2): 5^q for q in _LOWEST.._HIGHEST scaled to 128 bits, high word first; rounded down, or up for q < 0."""
    table = []
    for q in range(_LOWEST, _HIGHEST + 1):
        if q < 0:
            divisor = 5**-q
            scaled = (1 << (divisor.bit_length() + 127)) // divisor + 1
        else:
            scaled = 5**q << 400
        scaled >>= scaled.bit_length() - 128
        table.append((scaled >> 64, scaled & (2**64 - 1)))
    return np.array(table, dtype=np.uint64)


POWERS_OF_FIVE = _powers_of_five()


@njit(cache=True)
def read_double(
    data: Bytes, begin: int, end: int, powers: npt.NDArray[np.uint64], bits: npt.NDArray[np.uint64]
) -> bool:
    """Read data[begin:end] into the bit pattern bits[0]. False: not decided here, ask `float`.

    powers is POWERS_OF_FIVE, which a compiled function that is kept on disk takes as an argument.
    """
    at = begin
    sign = np.uint64(0)
    if data[at] == 45 or data[at] == 43:
        sign = np.uint64(1) << np.uint64(63) if data[at] == 45 else sign
        at += 1
    mantissa = np.uint64(0)
    digits, exponent, seen = 0, 0, 0
    point = False
    while at < end:
        byte = data[at]
        if byte == 46 and not point:
            point = True
        elif 48 <= byte <= 57:
            mantissa = mantissa * np.uint64(10) + np.uint64(byte - 48)
            seen += 1
            digits += 1 if mantissa > 0 else 0
            exponent -= point
        else:
            break
        at += 1
    if seen == 0 or digits > 19:
        return False
    if at < end:
        power, usual = _exponent(data, at, end)
        if not usual:
            return False
        exponent += power
    if mantissa == 0:
        bits[0] = sign
        return True
    if exponent < -290 or exponent > 280:
        return False
    return bool(_compose(mantissa, exponent, sign, powers, bits))


@njit(cache=True)
def read_scaled_integer(data: Bytes, begin: int, end: int, decimals: int) -> tuple[int, bool]:
    """The number in data[begin:end] times 10^decimals as an integer, rounded half to even.

    False beside it: not decided here, because it is not plain digits with at most one point, or near the end of int64.
    """
    at = begin
    negative = data[at] == 45
    if data[at] == 45 or data[at] == 43:
        at += 1
    whole, digits, places = 0, 0, 0
    above_half, half, point = False, False, False
    while at < end:
        byte = data[at]
        at += 1
        if byte == 46 and not point:
            point = True
            continue
        if byte < 48 or byte > 57:
            return 0, False
        digit = byte - np.int64(48)
        digits += 1
        if not point or places < decimals:
            if whole > 900_000_000_000_000_000:
                return 0, False
            whole = whole * 10 + digit
            places += point
        elif places == decimals:
            above_half, half = bool(digit > 5), bool(digit == 5)
            places += 1
        elif half and digit > 0:
            above_half = True
    for _ in range(decimals - min(places, decimals)):
        if whole > 900_000_000_000_000_000:
            return 0, False
        whole *= 10
    if above_half or (half and whole % 2 == 1):
        whole += 1
    return (-whole if negative else whole), digits > 0


@njit(cache=True)
def _exponent(data: Bytes, at: int, end: int) -> tuple[int, bool]:
    """The power of ten behind `e`, at most four digits."""
    if data[at] != 101 and data[at] != 69:
        return 0, False
    at += 1
    negative = at < end and data[at] == 45
    if at < end and (data[at] == 45 or data[at] == 43):
        at += 1
    if at == end or end - at > 4:
        return 0, False
    power = 0
    while at < end:
        if data[at] < 48 or data[at] > 57:
            return 0, False
        power = power * 10 + (data[at] - np.int64(48))
        at += 1
    return (-power if negative else power), True


@njit(cache=True)
def _compose(
    mantissa: np.uint64, exponent: int, sign: np.uint64, powers: npt.NDArray[np.uint64], bits: npt.NDArray[np.uint64]
) -> bool:
    """The double nearest to mantissa * 10^exponent (mantissa > 0), ties to even; Lemire's algorithm 1."""
    one = np.uint64(1)
    leading = 0
    while mantissa >> np.uint64(63) == 0:
        mantissa <<= one
        leading += 1
    factor = powers[exponent - _LOWEST]
    high, low = _product(mantissa, factor[0])
    if high & np.uint64(0x1FF) == np.uint64(0x1FF):  # the product is near a tie: take 64 more bits of the power
        second, _ = _product(mantissa, factor[1])
        low += second
        high += np.uint64(low < second)
        if low == np.uint64(0xFFFFFFFFFFFFFFFF) and (exponent < -27 or exponent > 55):
            return False
    upper = high >> np.uint64(63)
    shift = upper + np.uint64(9)
    value = high >> shift
    # floor(q log2(10)) by a multiplication, exact in this range.
    power = ((217706 * exponent) >> 16) + 63 + np.int64(upper) - leading + 1023
    if power <= 0 or power >= 2046:
        return False
    if low <= one and -4 <= exponent <= 23 and value & np.uint64(3) == one and value << shift == high:
        value &= ~one  # exactly between two doubles
    value += value & one
    value >>= one
    if value >= np.uint64(1) << np.uint64(53):
        value = np.uint64(1) << np.uint64(52)
        power += 1
    bits[0] = sign | (np.uint64(power) << np.uint64(52)) | (value & ((one << np.uint64(52)) - one))
    return True


@njit(cache=True)
def _product(a: np.uint64, b: np.uint64) -> tuple[np.uint64, np.uint64]:
    """The 128-bit product of two 64-bit integers, high and low word."""
    half, mask = np.uint64(32), np.uint64(0xFFFFFFFF)
    a1, a0, b1, b0 = a >> half, a & mask, b >> half, b & mask
    cross = a1 * b0 + ((a0 * b0) >> half)
    other = a0 * b1 + (cross & mask)
    return a1 * b1 + (cross >> half) + (other >> half), a * b
