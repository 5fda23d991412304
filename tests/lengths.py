"""How long random searches are: short in the fast lane, long where all tests run (`make test-all`)."""

import os

ALL = os.environ.get("PENTAPOD_TESTS") == "all"


def examples(short: int, long: int) -> int:
    """Return how many random examples a test looks at."""
    return long if ALL else short
