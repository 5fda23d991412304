"""Kinematics of the robots: leg lengths, assembly modes, singularities, Jacobian, statics, proofs.

The names below are imported when they are first used, so that a part of the package loads alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pentapod.base.registry import imported_when_used

if TYPE_CHECKING:
    from pentapod.kinematics.all_modes.all_modes import AllPoses as AllPoses
    from pentapod.kinematics.all_modes.all_modes import SearchOptions as SearchOptions
    from pentapod.kinematics.all_modes.all_modes import all_poses as all_poses
    from pentapod.kinematics.component import COMPONENTS as COMPONENTS
    from pentapod.kinematics.component import Component as Component
    from pentapod.kinematics.families.as_built import AsBuiltPentapod as AsBuiltPentapod
    from pentapod.kinematics.families.as_built_forward import ProvenPoses as ProvenPoses
    from pentapod.kinematics.families.as_built_forward import as_built_pose as as_built_pose
    from pentapod.kinematics.families.conics import Conic as Conic
    from pentapod.kinematics.families.conics import attachment_conic as attachment_conic
    from pentapod.kinematics.families.conics import conic_determinant as conic_determinant
    from pentapod.kinematics.families.conics import forbidden_conic as forbidden_conic
    from pentapod.kinematics.families.general import GeneralPentapod as GeneralPentapod
    from pentapod.kinematics.families.path_tracking import FollowedPath as FollowedPath
    from pentapod.kinematics.families.path_tracking import follow as follow
    from pentapod.kinematics.families.quadratic import LinearPentapod as LinearPentapod
    from pentapod.kinematics.families.reconfigurable import ReconfigurablePentapod as ReconfigurablePentapod
    from pentapod.kinematics.families.ringed import RingedPentapod as RingedPentapod
    from pentapod.kinematics.families.singularities import architectural_measure as architectural_measure
    from pentapod.kinematics.families.singularities import orientation_distance as orientation_distance
    from pentapod.kinematics.families.singularities import position_distance as position_distance
    from pentapod.kinematics.families.singularities import singular_plane as singular_plane
    from pentapod.kinematics.families.singularities import singularity_values as singularity_values
    from pentapod.kinematics.five_legs import FiveLegs as FiveLegs
    from pentapod.kinematics.forces import leg_force_map as leg_force_map
    from pentapod.kinematics.forces import leg_load_map as leg_load_map
    from pentapod.kinematics.forces import leg_moment_map as leg_moment_map
    from pentapod.kinematics.forces import tip_compliance as tip_compliance
    from pentapod.kinematics.forces import tip_force_amplification as tip_force_amplification
    from pentapod.kinematics.forces import tip_moment_amplification as tip_moment_amplification
    from pentapod.kinematics.forces import tip_stiffness as tip_stiffness
    from pentapod.kinematics.forward.singularity_polynomial import singularity_cofactors as singularity_cofactors
    from pentapod.kinematics.forward.singularity_polynomial import singularity_polynomial as singularity_polynomial
    from pentapod.kinematics.jacobian import pose_jacobian as pose_jacobian
    from pentapod.kinematics.jacobian import square_jacobian as square_jacobian
    from pentapod.kinematics.mode import MODES as MODES
    from pentapod.kinematics.mode import Mode as Mode
    from pentapod.kinematics.platforms.assembly_obstacles import AssemblyObstacle as AssemblyObstacle
    from pentapod.kinematics.platforms.assembly_obstacles import AssemblyObstacles as AssemblyObstacles
    from pentapod.kinematics.platforms.assembly_obstacles import assembly_obstacles as assembly_obstacles
    from pentapod.kinematics.platforms.assembly_obstacles import platform_obstacles as platform_obstacles
    from pentapod.kinematics.platforms.rolled_platform import RolledPlatform as RolledPlatform
    from pentapod.kinematics.platforms.six_leg import SixLegPlatform as SixLegPlatform
    from pentapod.kinematics.proof_results import Chords as Chords
    from pentapod.kinematics.proofs.certificate import ComponentProof as ComponentProof
    from pentapod.kinematics.proofs.certificate import certify_component as certify_component
    from pentapod.kinematics.proofs.chords import prove_chords as prove_chords
    from pentapod.kinematics.proofs.motion import MotionProof as MotionProof
    from pentapod.kinematics.proofs.motion import certify_motion as certify_motion
    from pentapod.kinematics.proofs.pose_enclosure import pose_enclosure as pose_enclosure
    from pentapod.kinematics.proofs.tip_tube import TipTube as TipTube
    from pentapod.kinematics.proofs.tip_tube import prove_tip_tube as prove_tip_tube
    from pentapod.kinematics.robot import Branch as Branch
    from pentapod.kinematics.robot import Robot as Robot
    from pentapod.kinematics.robot import SingularSurface as SingularSurface

_HOMES = {
    "kinematics.all_modes.all_modes": "AllPoses SearchOptions all_poses",
    "kinematics.component": "COMPONENTS Component",
    "kinematics.families.as_built": "AsBuiltPentapod",
    "kinematics.families.as_built_forward": "ProvenPoses as_built_pose",
    "kinematics.families.conics": "Conic attachment_conic conic_determinant forbidden_conic",
    "kinematics.families.general": "GeneralPentapod",
    "kinematics.families.path_tracking": "FollowedPath follow",
    "kinematics.families.quadratic": "LinearPentapod",
    "kinematics.families.reconfigurable": "ReconfigurablePentapod",
    "kinematics.families.ringed": "RingedPentapod",
    "kinematics.families.singularities": (
        "architectural_measure orientation_distance position_distance singular_plane singularity_values"
    ),
    "kinematics.five_legs": "FiveLegs",
    "kinematics.forces": (
        "leg_force_map leg_load_map leg_moment_map tip_compliance tip_force_amplification "
        "tip_moment_amplification tip_stiffness"
    ),
    "kinematics.forward.singularity_polynomial": "singularity_cofactors singularity_polynomial",
    "kinematics.jacobian": "pose_jacobian square_jacobian",
    "kinematics.mode": "MODES Mode",
    "kinematics.platforms.assembly_obstacles": (
        "AssemblyObstacle AssemblyObstacles assembly_obstacles platform_obstacles"
    ),
    "kinematics.platforms.rolled_platform": "RolledPlatform",
    "kinematics.platforms.six_leg": "SixLegPlatform",
    "kinematics.proof_results": "Chords",
    "kinematics.proofs.certificate": "ComponentProof certify_component",
    "kinematics.proofs.chords": "prove_chords",
    "kinematics.proofs.motion": "MotionProof certify_motion",
    "kinematics.proofs.pose_enclosure": "pose_enclosure",
    "kinematics.proofs.tip_tube": "TipTube prove_tip_tube",
    "kinematics.robot": "Branch Robot SingularSurface",
}

if not TYPE_CHECKING:  # type checkers read the imports above
    __getattr__, __dir__, __all__ = imported_when_used(__name__, _HOMES)
