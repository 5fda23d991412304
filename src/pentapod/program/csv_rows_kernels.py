"""Reader and writer of plain rows of numbers, compiled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pentapod.base.arrays import Floats
from pentapod.numerics.kernels import kernel

MOST_DIGITS = 15
"""Digits up to which a whole number is exact, and so is the power of ten by which it is divided: one rounding."""

COMMA, NEWLINE, RETURN, POINT, ZERO = 44, 10, 13, 46, 48  # bytes


@kernel
def plain_rows(text: NDArray[np.uint8], table: Floats) -> int:
    """Fill rows of table (n, k) from whole lines of k numbers such as 12.5, and return how many lines there are.

    −1 where a line is none of k numbers of at most `MOST_DIGITS` digits without sign and exponent, or there are more.
    """
    rows, columns = table.shape
    row, column, digits, decimals, whole, ended = 0, 0, 0, -1, 0, False
    for byte in text:
        digit = int(byte) - ZERO
        if 0 <= digit <= 9 and not ended:
            whole = 10 * whole + digit
            digits += 1
            if decimals >= 0:
                decimals += 1
            if digits > MOST_DIGITS:
                return -1
        elif byte == POINT and decimals < 0 and not ended:
            decimals = 0
        elif byte == RETURN and column == columns - 1 and not ended:
            ended = True
        elif digits > 0 and row < rows and byte == (NEWLINE if column == columns - 1 else COMMA):
            table[row, column] = whole / 10.0 ** max(decimals, 0)
            digits, decimals, whole, ended = 0, -1, 0, False
            column += 1
            if column == columns:
                row, column = row + 1, 0
        else:
            return -1
    return row if column == 0 and digits == 0 and decimals < 0 and not ended else -1


@kernel
def fill_rows(table: NDArray[np.int64], decimals: NDArray[np.int64], text: NDArray[np.uint8]) -> int:
    """Fill text with rows of table (n, k), counts of units of the last decimal (k,), none negative; return its length.

    text: of at least 20 bytes for each number and one more.
    """
    rows, columns = table.shape
    end = 0
    for row in range(rows):
        for column in range(columns):
            left, places = table[row, column], decimals[column]
            digits = places + 1  # one before the point
            largest = left // 10 ** (places + 1)
            while largest > 0:
                largest //= 10
                digits += 1
            end += digits + (2 if places > 0 else 1)
            at = end - 1
            text[at] = NEWLINE if column == columns - 1 else COMMA
            for k in range(digits):
                if k == places and places > 0:
                    at -= 1
                    text[at] = POINT
                at -= 1
                text[at] = ZERO + left % 10
                left //= 10
    return end
