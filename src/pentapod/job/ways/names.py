"""Names of the ways and of their files."""

IN, OUT = "way in", "way out"
"""From the machine's park pose to the first row of a program, and from its last row back."""

FILES = {IN: "way_in.csv", OUT: "way_out.csv"}
"""The file of each way, beside program.csv."""
