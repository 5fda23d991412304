"""digest_of: 16 hexadecimal digits that tell sets of numbers apart."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping

import numpy as np


def digest_of(numbers: Mapping[str, object]) -> str:
    """Return 16 hexadecimal digits of a SHA-256 over numbers, arrays and texts by name; −0 counts as 0."""
    plain = {name: _plain(value) for name, value in numbers.items()}
    text = json.dumps(plain, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _plain(value: object) -> object:
    return value if isinstance(value, str) else (np.asarray(value, dtype=np.float64) + 0.0).tolist()
