"""Tables for drives: cubic segments (PVT), cam tables, and LinuxCNC's halstreamer."""

from __future__ import annotations

from pentapod.program.posts.registry import register
from pentapod.program.posts.tables import Column, Files, Table, leg_columns, table_post

_TIME = Column("time_s", "time", "s", 9)


def _lengths(legs: int) -> tuple[Column, ...]:
    return leg_columns("leg{leg}_mm", "length", "mm", 8, legs)


def _pvt(legs: int) -> Files:
    rates = leg_columns("leg{leg}_mm_s", "velocity", "mm/s", 8, legs)
    return {"program.pvt.csv": (_TIME, *(c for pair in zip(_lengths(legs), rates, strict=True) for c in pair))}


def _cam(legs: int) -> Files:
    master = Column("master_ms", "time", "ms", 6)
    return {f"cam_leg{length.leg}.txt": (master, length) for length in _lengths(legs)}


def _halstream(legs: int) -> Files:
    return {"legs.halstream": _lengths(legs)}


PVT = register(
    table_post("pvt", "cubic segments for drives: time, then position and velocity of each leg", Table(_pvt))
)

CAM = register(
    table_post(
        "cam",
        "cam tables as Beckhoff's, one for each leg: equidistant master (time in ms) and slave (mm)",
        # Cam tables hold numbers only: master and slave, separated by a tab.
        Table(_cam, separator="\t", comment=None, titles=False),
    )
)

HALSTREAMER = register(
    table_post(
        "halstreamer",
        "LinuxCNC's halstreamer: the leg lengths in mm, one row each servo period",
        Table(_halstream, separator=" ", titles=False),
    )
)
