"""A small design file."""

from pathlib import Path

import pytest

SMALL = """
[start]
machine = "desk"
leg_stiffness_n_um = 50

[unknowns]
base_mm = [-598, 598]
beyond_mm = [80, 250]
centre_z_mm = [350, 800]

[objectives]
minimise = ["amplification", "footprint_mm"]

[at_most]
amplification = 5.3

[at_least]
clearance_mm = 2

[search]
population = 8
generations = 4
exchange = 2
members = 2
"""


@pytest.fixture
def design_file(tmp_path):
    """A function that writes the small design file, with texts replaced, and returns its path."""

    def written(*replaced: tuple[str, str]) -> Path:
        text = SMALL
        for old, new in replaced:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "design.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return written
