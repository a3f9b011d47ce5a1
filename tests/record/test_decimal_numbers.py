import struct
from decimal import Decimal

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from taskslam.record.decimal_numbers import POWERS_OF_FIVE, read_double, read_scaled_integer


def as_double(text):
    """The double, or None where the reader leaves it to `float`."""
    data = np.frombuffer(text.encode(), dtype=np.uint8)
    bits = np.zeros(1, dtype=np.uint64)
    decided = read_double(data, 0, len(data), POWERS_OF_FIVE, bits)
    return float(bits.view(np.float64)[0]) if decided else None


def as_integer(text, decimals):
    data = np.frombuffer(text.encode(), dtype=np.uint8)
    value, decided = read_scaled_integer(data, 0, len(data), decimals)
    return value if decided else None


@given(st.integers(0, 2**64 - 1))
def test_every_double_comes_back_from_its_repr_bit_for_bit(bits):
    text = repr(struct.unpack("d", struct.pack("Q", bits))[0])
    assert as_double(text) is None or as_double(text).hex() == float(text).hex()


@given(st.integers(0, 10**19 - 1), st.integers(-290, 280))
@example(9007199254740993, 0)  # a tie between two doubles
@example(9007199254740993, 22)
@example(2**64 // 10, -27)
def test_any_nineteen_digits_round_as_float_does(mantissa, exponent):
    text = f"{mantissa}e{exponent}"
    if as_double(text) is not None:
        assert as_double(text).hex() == float(text).hex()


@given(st.integers(2**52, 2**54).map(lambda k: 2 * k + 1), st.integers(1, 8))
def test_exact_ties_go_to_even(odd, halvings):
    text = format(Decimal(odd) / 2**halvings, "f")
    if as_double(text) is not None:
        assert as_double(text).hex() == float(text).hex()


def test_numbers_of_everyday_files_are_decided_here():
    texts = ["0", "-0.0", "1.", ".5", "+2", "4.688319", "1.403636579763555527e+09", "-0.12345678901234567", "1E-7"]
    assert [as_double(text) for text in texts] == [float(text) for text in texts]


@pytest.mark.parametrize(
    "text", ["nan", "inf", "1e", "e5", "-", "--1", "1_0", "0x10", "1.2.3", "1-2", "1" * 25, "1e400"]
)
def test_what_is_no_plain_number_is_left_to_float(text):
    assert as_double(text) is None


@given(st.integers(-(10**17), 10**17), st.integers(0, 14))
def test_stamps_round_half_to_even_without_floating_point(digits, places):
    value = Decimal(digits).scaleb(-places)
    expected = int((value * 10**9).to_integral_value())
    assert as_integer(format(value, "f"), 9) in (expected, None)
    if abs(expected) < 9 * 10**17:
        assert as_integer(format(value, "f"), 9) == expected


@pytest.mark.parametrize("text", ["", "-", ".", "1e9", "nan", "1.2.3", "9" * 19])
def test_an_unusual_stamp_is_not_decided_here(text):
    assert as_integer(text + " ", 9) is None or text == ""
