"""The browser in which tests open pages: headless Chromium; without it they are skipped and say so."""

from __future__ import annotations

import os
import shutil

import pytest

CHROMIUM = os.environ.get("PENTAPOD_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium; PENTAPOD_CHROMIUM may name one")
IN_A_BROWSER = [
    needs_chromium,
    # What playwright leaves to the garbage collector is no fault of the page.
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]
"""Marks of modules whose tests open pages."""

PATIENCE_MS = 240_000
"""A busy machine without a GPU is no failure."""
