"""Programs: leg-length setpoints at the controller's period, and the files that hold them."""

from pentapod.program.csv import read_csv, read_header, write_csv
from pentapod.program.program import FORMAT_VERSION, Program, Provenance, Switch
from pentapod.program.resolution import quantised
from pentapod.program.sampling import sample

__all__ = [
    "FORMAT_VERSION",
    "Program",
    "Provenance",
    "Switch",
    "quantised",
    "read_csv",
    "read_header",
    "sample",
    "write_csv",
]
