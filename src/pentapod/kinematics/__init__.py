"""The robot as mathematics: leg lengths, assembly modes, singularities, Jacobian, forces, certificates."""

from pentapod.kinematics.architecture import ArchitecturalDistance, architectural_distance
from pentapod.kinematics.as_built import AsBuiltPentapod
from pentapod.kinematics.as_built_forward import ProvenPoses, as_built_pose
from pentapod.kinematics.assembly import AssemblyObstacles, Obstacle, assembly_obstacles, platform_obstacles
from pentapod.kinematics.calibration import Calibration, calibrate
from pentapod.kinematics.cell_poses import cell_of, poses_in_cell
from pentapod.kinematics.cells import Cell, CellDecomposition, cell_decomposition
from pentapod.kinematics.certificate import ComponentProof, certify_component
from pentapod.kinematics.chords import Chords, prove_chords
from pentapod.kinematics.component import COMPONENTS, Component
from pentapod.kinematics.conics import Conic, attachment_conic, conic_determinant, forbidden_conic
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.kinematics.following import FollowedPath, follow
from pentapod.kinematics.forces import (
    leg_force_map,
    leg_load_map,
    leg_moment_map,
    tip_force_amplification,
    tip_moment_amplification,
)
from pentapod.kinematics.general import GeneralPentapod
from pentapod.kinematics.guide_choice import GuideChoice, choose_slides, conditioning_criterion, stiffness_criterion
from pentapod.kinematics.guides import ReconfigurablePentapod
from pentapod.kinematics.jacobian import leg_jacobian, pose_jacobian, square_jacobian
from pentapod.kinematics.mode import MODES, Mode
from pentapod.kinematics.motion import MotionProof, certify_motion
from pentapod.kinematics.pentapod import LinearPentapod
from pentapod.kinematics.reach import ReachField
from pentapod.kinematics.roaming import roaming
from pentapod.kinematics.singularities import (
    architectural_measure,
    orientation_distance,
    position_distance,
    singular_plane,
    singularity_values,
)
from pentapod.kinematics.singularity_polynomial import singularity_cofactors, singularity_polynomial
from pentapod.kinematics.six_legs import SixLegPlatform
from pentapod.kinematics.sphere import SingularityFreeSphere, singularity_free_sphere
from pentapod.kinematics.stiffness import tip_compliance, tip_stiffness
from pentapod.kinematics.tip_tube import TipTube, prove_tip_tube
from pentapod.kinematics.workspace import Workspace

__all__ = [
    "COMPONENTS",
    "MODES",
    "ArchitecturalDistance",
    "AsBuiltPentapod",
    "AssemblyObstacles",
    "Calibration",
    "Cell",
    "CellDecomposition",
    "Chords",
    "Component",
    "ComponentProof",
    "Conic",
    "FiveLegs",
    "FollowedPath",
    "GeneralPentapod",
    "GuideChoice",
    "LinearPentapod",
    "Mode",
    "MotionProof",
    "Obstacle",
    "ProvenPoses",
    "ReachField",
    "ReconfigurablePentapod",
    "SingularityFreeSphere",
    "SixLegPlatform",
    "TipTube",
    "Workspace",
    "architectural_distance",
    "architectural_measure",
    "as_built_pose",
    "assembly_obstacles",
    "attachment_conic",
    "calibrate",
    "cell_decomposition",
    "cell_of",
    "certify_component",
    "certify_motion",
    "choose_slides",
    "conditioning_criterion",
    "conic_determinant",
    "follow",
    "forbidden_conic",
    "leg_force_map",
    "leg_jacobian",
    "leg_load_map",
    "leg_moment_map",
    "orientation_distance",
    "platform_obstacles",
    "pose_jacobian",
    "poses_in_cell",
    "position_distance",
    "prove_chords",
    "prove_tip_tube",
    "roaming",
    "singular_plane",
    "singularity_cofactors",
    "singularity_free_sphere",
    "singularity_polynomial",
    "singularity_values",
    "square_jacobian",
    "stiffness_criterion",
    "tip_compliance",
    "tip_force_amplification",
    "tip_moment_amplification",
    "tip_stiffness",
]
