"""ConstrainedPlatform: five legs to a rigid platform, whose turn about the tool axis passive joints decide.

The 5-DoF robots of the paper's introduction are of this kind. A passive joint lets the platform turn about an axis y of
its own, perpendicular to the tool axis i, and keeps y perpendicular to a line of the base:

- 4-UPS+SPR (Lu and others): leg 5 ends on the tool axis in a revolute joint about y, so y is perpendicular to leg 5,
  y · (p + z_5 i − a_5) = 0, and y = (p − a_5) × i normalised.
- 5-UPS+PRPU (Zhao and others): the first axis c of the passive limb's universal joint, parallel to its revolute joint,
  keeps its direction in space, so y · c = 0, and y = c × i normalised.

Both are y = n / |n|, n = (h p + g) × i, with h = 1, g = −a_5, or h = 0, g = c. With x = y × i the platform's rotation
is R = [x y i], and leg k ends in b_k = p + R (its joint in the platform's frame). So a pose of the tool is one of the
platform, inverse kinematics has this closed form, and the leg equations are quadratic in (p, x, y, i).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pentapod.base.arrays import Floats, as_batch, frozen, set_frozen
from pentapod.base.errors import MachineError
from pentapod.base.values import Value
from pentapod.kinematics.arithmetic import NUMPY, Arithmetic, Joints, Vector, dot
from pentapod.kinematics.batches import joined_poses
from pentapod.kinematics.five_legs import given
from pentapod.kinematics.leibniz import cross_products, scalar_products, square_roots, unit_vectors
from pentapod.kinematics.mode import MODES, Mode
from pentapod.kinematics.platforms.constrained_poses import all_poses, continued_poses
from pentapod.kinematics.platforms.constrained_proofs import ProvenByKrawczyk
from pentapod.kinematics.robot import Branch, SingularSurface
from pentapod.kinematics.wrench_determinant import Wrench, cross, leg_wrenches, wrench_determinant, zero_distance

Constraint = Literal["revolute leg", "universal joint"]


@dataclass(frozen=True, eq=False)
class ConstrainedPlatform(Value, ProvenByKrawczyk):
    """Five legs from the base plane to joints (5, 3) of a platform, in its frame [x y i]; metres.

    base (5, 2): base joints in the plane z = 0. constraint: "revolute leg", where leg 5 ends on the tool axis, or
    "universal joint", with the direction `guide` (2,) in the base plane. home: position p (3,) of a pose with the tool
    along +z, in the component in which the robot is mounted; forward kinematics begins there.

    A branch is named by the sign of the Jacobian's determinant and that of w (a `Mode`). Several poses can have the
    same legs and the same name: `pose` returns the one that continues the pose at home, and none in the other branches.

    Raises MachineError: wrong shapes, a fifth leg beside the tool axis, a home that is singular.
    """

    base: Floats
    joints: Floats
    constraint: Constraint
    home: Floats
    guide: Floats | None = None
    n_legs = 5
    branches = MODES

    def __post_init__(self) -> None:
        shapes = {"base": (5, 2), "joints": (5, 3), "home": (3,)}
        set_frozen(
            self, **{name: frozen(given(getattr(self, name), name, shape), name) for name, shape in shapes.items()}
        )
        if self.constraint == "universal joint":
            guide = given((1.0, 0.0) if self.guide is None else self.guide, "guide", (2,))
            set_frozen(self, guide=frozen(guide / max(float(np.hypot(*guide)), 1e-300), "guide"))
        elif np.hypot(*self.joints[4, :2]) > 0.0:
            raise MachineError(
                "the revolute leg ends beside the tool axis", key="joints", value=self.joints[4].tolist(),
                expected="leg 5 with a joint [0, 0, z]",
            )  # fmt: skip

    @property
    def base_joints(self) -> Floats:
        """The joints on the base (5, 3)."""
        return frozen(np.column_stack([self.base, np.zeros(5)]), "base_joints")

    @property
    def offsets(self) -> Floats:
        """Where the arms of the platform joints meet the tool axis (5,)."""
        return frozen(self.joints[:, 2].copy(), "offsets")

    @property
    def arms(self) -> Floats:
        """The distances of the platform joints from the tool axis (5,)."""
        return frozen(np.hypot(self.joints[:, 0], self.joints[:, 1]), "arms")

    @property
    def law(self) -> tuple[float, Floats]:
        """The numbers h and g (3,) of n = (h p + g) × i."""
        if self.constraint == "revolute leg":
            return 1.0, -self.base_joints[4]
        return 0.0, np.array([*np.asarray(self.guide), 0.0])

    @property
    def singularities(self) -> tuple[SingularSurface, ...]:
        """The plane where w changes its sign, the zeros of the determinant, and where the passive joint lets go."""
        through = SingularSurface("tool axis through base joint 5", "mm")
        return (
            SingularSurface("mirror plane w = 0", "deg"),
            SingularSurface("singular surface, to first order", "mm"),
            through if self.law[0] else SingularSurface("tool axis along the guide", "deg"),
        )

    @property
    def conditioning(self) -> float:
        """The reciprocal condition number of the wrenches at home, with the largest arm as the unit of length."""
        p, i = self.home, np.array([0.0, 0.0, 1.0])
        rows = self._wrenches(list(p), list(i), NUMPY)
        wrenches = np.array([[*(force or (0.0, 0.0, 0.0)), *moment] for force, moment in rows], dtype=np.float64)
        wrenches[:, 3:] /= max(float(np.linalg.norm(self.joints, axis=1).max()), 1e-300)
        wrenches /= np.linalg.norm(wrenches, axis=1, keepdims=True)
        values = np.linalg.svd(wrenches, compute_uv=False)
        return float(values[-1] / values[0])

    @property
    def numbers(self) -> Mapping[str, object]:
        """All numbers of the geometry."""
        own = {"base": self.base, "joints": self.joints, "home": self.home, "law": self.law[1]}
        return {"family": "4-UPS+SPR" if self.law[0] else "5-UPS+PRPU", **own}

    def branch(self, position: ArrayLike, direction: ArrayLike) -> NDArray[np.int8]:
        """Return the signs (..., 2) of determinant and w; 0 on a singularity and for NaN."""
        p, i = joined_poses(position, direction)
        with np.errstate(invalid="ignore", divide="ignore"):
            labels = np.stack([self._determinant(*_split(p, i), NUMPY), i[..., 2]], axis=-1)
        return np.nan_to_num(np.sign(labels)).astype(np.int8)

    def rotation(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return the platform's rotations (..., 3, 3) in poses (..., 3); NaN where the passive joint lets go."""
        p, i = joined_poses(position, direction)
        (h, g) = self.law
        with np.errstate(invalid="ignore", divide="ignore"):
            y = np.cross(h * p + g, i)
            y = y / np.linalg.norm(y, axis=-1, keepdims=True)
        return np.asarray(np.stack([np.cross(y, i), y, i], axis=-1), dtype=np.float64)

    def pose(self, legs: ArrayLike, branch: ArrayLike) -> tuple[Floats, Floats]:
        """Return positions and directions (..., 3) of leg lengths (..., 5) in a branch, continued from home.

        NaN where Newton's method finds none, and where what it finds is in another branch.
        """
        lengths = as_batch(legs, "legs", (5,))
        signs = np.broadcast_to(as_batch(branch, "branch", (2,)), (*lengths.shape[:-1], 2)).reshape(-1, 2)
        p, i = continued_poses(self, lengths.reshape(-1, 5), signs)
        return p.reshape(*lengths.shape[:-1], 3), i.reshape(*lengths.shape[:-1], 3)

    def all_poses(self, legs: ArrayLike) -> tuple[Floats, Floats]:
        """Return the different poses (K, 3) of leg lengths (5,) that are found; that of `pose` is the first."""
        return all_poses(self, as_batch(legs, "legs", (5,)))

    def leg_lengths(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return leg lengths (..., 5), metres, of poses (..., 3)."""
        return np.asarray(np.linalg.norm(self.leg_vectors(position, direction), axis=-1), dtype=np.float64)

    def leg_vectors(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return the vectors (..., 5, 3) from base joints to platform joints."""
        return self.platform_joints(position, direction) - self.base_joints

    def platform_joints(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return where the legs end (..., 5, 3)."""
        p, i = joined_poses(position, direction)
        return p[..., None, :] + self.joints @ np.swapaxes(self.rotation(p, i), -1, -2)

    def jacobian(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return ∂legs/∂(p, i) (..., 5, 6), the platform turned by its passive joints: m/m, metres per change of i."""
        p, i = joined_poses(position, direction)
        h, g = self.law
        normal, r = np.cross(h * p + g, i), self.rotation(p, i)
        y, size = r[..., 1], np.linalg.norm(normal, axis=-1, keepdims=True)
        vectors = self.leg_vectors(p, i)
        unit = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
        columns: list[Floats] = []
        for k in range(6):
            dp, di = np.zeros(3), np.zeros(3)
            (dp if k < 3 else di)[k % 3] = 1.0
            dn = np.cross(h * dp, i) + np.cross(h * p + g, di)
            dy = (dn - y * np.einsum("...c,...c->...", y, dn)[..., None]) / size
            dx = np.cross(dy, i) + np.cross(y, di)
            turned = np.stack([dx, dy, np.broadcast_to(di, dx.shape)], axis=-2)
            columns.append(np.einsum("...kc,...kc->...k", unit, dp + self.joints @ turned))
        return np.stack(columns, axis=-1)

    def passive_wrenches(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return what the passive joint holds (..., 1, 6): a force along y at base joint 5, or a moment along c × y."""
        p, i = joined_poses(position, direction)
        h, g = self.law
        y = self.rotation(p, i)[..., 1]
        force, moment = (y, np.cross(-g - p, y)) if h else (np.zeros_like(y), np.cross(g, y))
        return np.concatenate([force, moment], axis=-1)[..., None, :]

    def hinges(self, position: ArrayLike, direction: ArrayLike) -> Mapping[int, Floats]:
        """Return the axis y (..., 3) of leg 5's revolute joint, by its index; nothing for a universal joint."""
        return {4: self.rotation(position, direction)[..., 1]} if self.law[0] else {}

    def leg_derivatives(self, tips: Sequence[tuple[Floats, Floats]], tool_length: float) -> list[Floats]:
        """Return leg lengths (n, 5) and their derivatives along a curve, of as many orders as are given."""
        i = [-axis for _, axis in tips]
        p = [tip + tool_length * axis for tip, axis in tips]
        h, g = self.law
        anchor = [h * value + (g if k == 0 else 0.0) for k, value in enumerate(p)]
        y = unit_vectors(cross_products(anchor, i))
        x = cross_products(y, i)
        legs = [a[:, None] + self.joints @ np.stack(axes, axis=1) for a, *axes in zip(p, x, y, i, strict=True)]
        legs[0] = legs[0] - self.base_joints
        return square_roots(scalar_products(legs, legs))

    def vectors_of(self, p: Vector, i: Vector, do: Arithmetic, joints: Joints | None = None) -> list[Vector]:
        """Return `leg_vectors`, one for each leg, by a formula for numbers and symbols alike; joints do not move."""
        x, y = self._frame(p, i, do)
        found: list[Vector] = []
        for (bx, by, bz), base in zip(self.joints.tolist(), self.base_joints.tolist(), strict=True):
            found.append([p[k] + bx * x[k] + by * y[k] + bz * i[k] - base[k] for k in range(3)])
        return found

    def lengths_of(self, vectors: Sequence[Vector], do: Arithmetic) -> list[Any]:
        """Return the lengths of vectors."""
        return [do.sqrt(dot(d, d)) for d in vectors]

    def singularity_margins(self, p: Vector, i: Vector, branch: Branch, do: Arithmetic) -> list[Any]:
        """Return w, the determinant by the length of its gradient in p (by differences), and |n|.

        The second is the distance by which the platform can shift unturned to the singular surface, to first order.
        """
        mode = Mode(*branch)
        distance = zero_distance(lambda at: self._determinant(at, i, do), p, do)
        n = self._normal(p, i)
        return [mode.image * i[2], mode.order * distance, do.sqrt(dot(n, n))]

    def _normal(self, p: Vector, i: Vector) -> Vector:
        (h, g) = self.law
        return cross([h * p[k] + float(g[k]) for k in range(3)], i)

    def _frame(self, p: Vector, i: Vector, do: Arithmetic) -> tuple[Vector, Vector]:
        n = self._normal(p, i)
        size = do.sqrt(dot(n, n))
        y = [n[k] / size for k in range(3)]
        return cross(y, i), y

    def _wrenches(self, p: Vector, i: Vector, do: Arithmetic) -> list[Wrench]:
        """Return the wrenches of legs and passive joint, force and moment about p: `held_wrenches` as one formula."""
        h, g = self.law
        _, y = self._frame(p, i, do)
        at = [float(-g[k]) - p[k] for k in range(3)]
        passive: Wrench = (y, cross(at, y)) if h else (None, cross(g.tolist(), y))
        return [*leg_wrenches(p, self.vectors_of(p, i, do), self.base_joints.tolist(), do), passive]

    def _determinant(self, p: Vector, i: Vector, do: Arithmetic) -> Any:
        return wrench_determinant(self._wrenches(p, i, do))


def _split(p: Floats, i: Floats) -> tuple[list[Floats], list[Floats]]:
    return list(np.moveaxis(p, -1, 0)), list(np.moveaxis(i, -1, 0))
