"""Simulation: what a machine with real drives, or with masses and forces, makes of a program."""

from pentapod.simulate.contour import contour_errors
from pentapod.simulate.cutting import cutting_forces
from pentapod.simulate.measures import Measure, Tracking
from pentapod.simulate.mjcf import mjcf
from pentapod.simulate.mujoco_engine import Physics, Plant, load_mujoco, plant, simulate_mujoco
from pentapod.simulate.played import Played
from pentapod.simulate.reference import Reference
from pentapod.simulate.servo import simulate_servo

__all__ = [
    "Measure",
    "Physics",
    "Plant",
    "Played",
    "Reference",
    "Tracking",
    "contour_errors",
    "cutting_forces",
    "load_mujoco",
    "mjcf",
    "plant",
    "simulate_mujoco",
    "simulate_servo",
]
