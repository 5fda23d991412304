"""The robot as mathematics: leg lengths, assembly modes, singularities, Jacobian, forces, certificates."""

from pentapod.kinematics.certificate import ComponentProof, certify_component
from pentapod.kinematics.component import COMPONENTS, Component
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.kinematics.forces import leg_force_map, tip_force_amplification
from pentapod.kinematics.jacobian import leg_jacobian, pose_jacobian, square_jacobian
from pentapod.kinematics.pentapod import LinearPentapod
from pentapod.kinematics.singularities import (
    architectural_measure,
    orientation_distance,
    position_distance,
    singularity_values,
)

__all__ = [
    "COMPONENTS",
    "Component",
    "ComponentProof",
    "FiveLegs",
    "LinearPentapod",
    "architectural_measure",
    "certify_component",
    "leg_force_map",
    "leg_jacobian",
    "orientation_distance",
    "pose_jacobian",
    "position_distance",
    "singularity_values",
    "square_jacobian",
    "tip_force_amplification",
]
