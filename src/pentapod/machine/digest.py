"""A short hash over named numbers, the same wherever the numbers are the same."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping

import numpy as np


def digest_of(values: Mapping[str, object]) -> str:
    """Return 16 hexadecimal digits: SHA-256 over the values, sorted by name, floats in their shortest form.

    Values are strings, numbers and arrays of numbers; −0 counts as 0.
    """
    plain = {
        name: value if isinstance(value, str) else (np.asarray(value, dtype=np.float64) + 0.0).tolist()
        for name, value in values.items()
    }
    text = json.dumps(plain, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:16]
