"""What a page's script reads, decoded without it: JSON, and arrays by an independent reading of their format."""

from __future__ import annotations

import base64
import gzip
import json
import re
from typing import Any

import numpy as np


def page_data(text: str) -> dict[str, Any]:
    """The JSON of a page."""
    return json.loads(_content(text, "page"))


def page_arrays(text: str) -> dict[str, np.ndarray]:
    """All arrays (rows, columns) of a page by name."""
    return arrays_of(page_data(text)["arrays"], _content(text, "arrays"))


def arrays_of(directory: dict[str, Any], block: str) -> dict[str, np.ndarray]:
    """All arrays (rows, columns) of a block by name."""
    content = np.frombuffer(gzip.decompress(base64.b64decode(block)), np.uint8)
    found = {}
    for name, entry in directory.items():
        rows, columns, size = entry["rows"], entry["columns"], entry["size"]
        places = entry["at"] + np.arange(size * rows * columns)
        planes = content[places].reshape(size, columns, rows).astype(np.int64)
        code = sum(plane * 256**k for k, plane in enumerate(planes))
        signed = np.where(code % 2 == 0, code // 2, -(code + 1) // 2)
        whole = np.cumsum(signed, axis=1) % (1 << (8 * size)) if rows else signed
        found[name] = whole.T.astype(np.float64)
        if "low" in entry:
            whole = found[name]
            scaled = np.array(entry["low"]) + np.array(entry["step"]) * whole
            found[name] = np.where(whole == 0, np.nan, scaled)
    return found


def _content(text: str, name: str) -> str:
    match = re.search(rf'<script type="[^"]*" id="{name}">(.*?)</script>', text, re.S)
    assert match is not None, name
    return match[1]
