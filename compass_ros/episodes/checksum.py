"""CRC-32 of two pieces put together, from theirs: zlib has it (`crc32_combine`), Python's module does not show it.

The checksum of A + B is that of A times x^(8 |B|), modulo the polynomial, plus that of B. A polynomial is a number
whose bit 31 is the coefficient of 1, as in zlib's crc32.c.
"""

from __future__ import annotations

from functools import cache

_POLYNOMIAL = 0xEDB88320
_ONE = 1 << 31


def joined(first: int, second: int, second_bytes: int) -> int:
    """CRC-32 of A + B, from that of A, that of B, and B's length [bytes]."""
    shift = _ONE
    for bit in range(second_bytes.bit_length()):
        if second_bytes >> bit & 1:
            shift = _product(shift, _power(bit + 3))  # a byte has 2^3 bits
    return _product(shift, first) ^ second


@cache
def _power(k: int) -> int:
    """x^(2^k)"""
    return _ONE >> 1 if k == 0 else _product(_power(k - 1), _power(k - 1))


def _product(a: int, b: int) -> int:
    found = 0
    while a:
        if a & _ONE:
            found ^= b
        a = a << 1 & 0xFFFFFFFF
        b = b >> 1 ^ (_POLYNOMIAL if b & 1 else 0)
    return found
