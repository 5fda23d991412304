"""Kinematics of the robots: leg lengths, assembly modes, singularities, Jacobian, statics, proofs."""

from pentapod.kinematics.all_modes.all_modes import AllPoses, SearchOptions, all_poses
from pentapod.kinematics.component import COMPONENTS, Component
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.kinematics.families.as_built_forward import ProvenPoses, as_built_pose
from pentapod.kinematics.families.conics import Conic, attachment_conic, conic_determinant, forbidden_conic
from pentapod.kinematics.families.general import GeneralPentapod
from pentapod.kinematics.families.path_tracking import FollowedPath, follow
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.kinematics.families.reconfigurable import ReconfigurablePentapod
from pentapod.kinematics.families.ringed import RingedPentapod
from pentapod.kinematics.families.singularities import (
    architectural_measure,
    orientation_distance,
    position_distance,
    singular_plane,
    singularity_values,
)
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.kinematics.forces import (
    leg_force_map,
    leg_load_map,
    leg_moment_map,
    tip_compliance,
    tip_force_amplification,
    tip_moment_amplification,
    tip_stiffness,
)
from pentapod.kinematics.forward.singularity_polynomial import singularity_cofactors, singularity_polynomial
from pentapod.kinematics.jacobian import pose_jacobian, square_jacobian
from pentapod.kinematics.mode import MODES, Mode
from pentapod.kinematics.platforms.assembly_obstacles import (
    AssemblyObstacle,
    AssemblyObstacles,
    assembly_obstacles,
    platform_obstacles,
)
from pentapod.kinematics.platforms.rolled_platform import RolledPlatform
from pentapod.kinematics.platforms.six_leg import SixLegPlatform
from pentapod.kinematics.proof_results import Chords
from pentapod.kinematics.proofs.certificate import ComponentProof, certify_component
from pentapod.kinematics.proofs.chords import prove_chords
from pentapod.kinematics.proofs.motion import MotionProof, certify_motion
from pentapod.kinematics.proofs.pose_enclosure import pose_enclosure
from pentapod.kinematics.proofs.tip_tube import TipTube, prove_tip_tube
from pentapod.kinematics.robot import Branch, Robot, SingularSurface

__all__ = [
    "COMPONENTS",
    "MODES",
    "AllPoses",
    "AsBuiltPentapod",
    "AssemblyObstacle",
    "AssemblyObstacles",
    "Branch",
    "Chords",
    "Component",
    "ComponentProof",
    "Conic",
    "FiveLegs",
    "FollowedPath",
    "GeneralPentapod",
    "LinearPentapod",
    "Mode",
    "MotionProof",
    "ProvenPoses",
    "ReconfigurablePentapod",
    "RingedPentapod",
    "Robot",
    "RolledPlatform",
    "SearchOptions",
    "SingularSurface",
    "SixLegPlatform",
    "TipTube",
    "all_poses",
    "architectural_measure",
    "as_built_pose",
    "assembly_obstacles",
    "attachment_conic",
    "certify_component",
    "certify_motion",
    "conic_determinant",
    "follow",
    "forbidden_conic",
    "leg_force_map",
    "leg_load_map",
    "leg_moment_map",
    "orientation_distance",
    "platform_obstacles",
    "pose_enclosure",
    "pose_jacobian",
    "position_distance",
    "prove_chords",
    "prove_tip_tube",
    "singular_plane",
    "singularity_cofactors",
    "singularity_polynomial",
    "singularity_values",
    "square_jacobian",
    "tip_compliance",
    "tip_force_amplification",
    "tip_moment_amplification",
    "tip_stiffness",
]
