"""Simulation: tracking of a program by a machine with servo drives, or with masses and forces."""

from pentapod.simulate.forces import cutting_forces
from pentapod.simulate.measures import Measure, Tracking, contour_errors
from pentapod.simulate.mujoco_engine import Physics, Plant, load_mujoco, plant, simulate_mujoco
from pentapod.simulate.reference import Played, Reference
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
    "plant",
    "simulate_mujoco",
    "simulate_servo",
]
