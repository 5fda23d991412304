"""Tables for drives: cubic segments (PVT), cam tables, and LinuxCNC's halstreamer."""

from __future__ import annotations

from pentapod.program.posts.registry import register
from pentapod.program.posts.tables import Column, Table, leg_columns, table_post

_TIME = Column("time_s", "time", "s", 9)
_LENGTHS = leg_columns("leg{leg}_mm", "length", "mm", 8)
_RATES = leg_columns("leg{leg}_mm_s", "velocity", "mm/s", 8)

PVT = register(
    table_post(
        "pvt",
        "cubic segments for drives: time, then position and velocity of each leg",
        Table({"program.pvt.csv": (_TIME, *(c for pair in zip(_LENGTHS, _RATES, strict=True) for c in pair))}),
    )
)

CAM = register(
    table_post(
        "cam",
        "cam tables as Beckhoff's, one for each leg: equidistant master (time in ms) and slave (mm)",
        # Cam tables hold numbers only: master and slave, separated by a tab.
        Table(
            {f"cam_leg{length.leg}.txt": (Column("master_ms", "time", "ms", 6), length) for length in _LENGTHS},
            separator="\t",
            comment=None,
            titles=False,
        ),
    )
)

HALSTREAMER = register(
    table_post(
        "halstreamer",
        "LinuxCNC's halstreamer: the five leg lengths in mm, one row each servo period",
        Table({"legs.halstream": _LENGTHS}, separator=" ", titles=False),
    )
)
