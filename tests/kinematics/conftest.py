"""The pentapods that every kinematic test runs on, and random poses for them."""

from pentapods import conic_determinant, leg_determinant, paper, pentapod, random_poses

__all__ = ["conic_determinant", "leg_determinant", "paper", "pentapod", "random_poses"]
