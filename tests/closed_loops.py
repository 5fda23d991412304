"""Models of machines in MuJoCo: slides set to what legs read, loops closed by Newton's method; SDF read into MJCF.

MuJoCo's own constraints and their Jacobian are used, and nothing of our kinematics.
"""

from __future__ import annotations

from xml.etree import ElementTree as Xml

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
KINDS = {"fixed": [], "revolute": ["hinge"], "prismatic": ["slide"], "universal": ["hinge", "hinge"], "ball": ["ball"]}
ASIDE = 0.05  # metres along a hinge's axis to the second point that holds it


class Closed:
    """A model; `stand(positions)` sets its joints leg1, leg2, ... and moves all others until the loops close."""

    def __init__(self, xml: str) -> None:
        self.model = mujoco.MjModel.from_xml_string(xml)
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.data = mujoco.MjData(self.model)
        names = [self.model.joint(k).name for k in range(self.model.njnt)]
        legs = [self.model.joint(name) for name in sorted(n for n in names if n[:3] == "leg" and n[3:].isdigit())]
        self.slides = [int(leg.qposadr[0]) for leg in legs]
        self.free = np.setdiff1d(np.arange(self.model.nv), [int(leg.dofadr[0]) for leg in legs])

    def stand(self, positions: np.ndarray, steps: int = 20) -> float:
        """Return the largest gap of the loops in metres that is left."""
        self.data.qpos[self.slides] = positions
        for _ in range(steps):
            mujoco.mj_fwdPosition(self.model, self.data)
            gaps = self.data.efc_pos[: self.data.ne].copy()
            rows = self.data.efc_J.reshape(-1, self.model.nv)[: self.data.ne, self.free]
            move = np.zeros(self.model.nv)
            move[self.free] = -np.linalg.lstsq(rows, gaps, rcond=1e-10)[0]
            if np.abs(gaps).max() < 1e-13:
                break
            mujoco.mj_integratePos(self.model, self.data.qpos, move, 1.0)
        return float(np.abs(gaps).max())

    def site(self, *names: str) -> np.ndarray:
        """Where the first site is that the model has, of these."""
        known = {self.model.site(k).name for k in range(self.model.nsite)}
        return self.data.site(next(name for name in names if name in known)).xpos

    def apart(self, base: np.ndarray, number: int) -> float:
        """How far a base joint (3,) is from the leg's joint on the platform, metres, by the platform's own frame."""
        return float(np.linalg.norm(self.data.site(f"platform{number}").xpos - base))


def in_mjcf(sdf: str) -> str:
    """Return a world of SDF as MJCF: a tree by the first joint with a link as its child, `connect` for the others."""
    world = Xml.fromstring(sdf).find("world")
    gravity, model = numbers(world.find("gravity")), world.find("model")
    links = {link.get("name"): frame(link) for link in model.findall("link")}
    links["world"] = np.eye(4)
    joints = model.findall("joint")
    root = Xml.Element("mujoco")
    Xml.SubElement(root, "compiler", angle="radian")
    Xml.SubElement(root, "option", gravity=words(gravity))
    bodies = {"world": Xml.SubElement(root, "worldbody")}
    loops = Xml.SubElement(root, "equality")
    waiting, closing = sorted(joints, key=lambda joint: joint.get("type") in {"ball"}), []
    while waiting:
        joint = next(j for j in waiting if j.findtext("parent") in bodies)
        waiting.remove(joint)
        parent, child = joint.findtext("parent"), joint.findtext("child")
        if child in bodies:
            closing.append(joint)
            continue
        place = np.linalg.inv(links[parent]) @ links[child]
        bodies[child] = body = Xml.SubElement(bodies[parent], "body", name=child, **posed(place))
        inertial = next(link for link in model.findall("link") if link.get("name") == child).find("inertial")
        if inertial is not None:
            moments = [float(inertial.findtext(f"inertia/{name}")) for name in ("ixx", "iyy", "izz")]
            what = {"mass": inertial.findtext("mass"), "pos": words(frame(inertial)[:3, 3])}
            Xml.SubElement(body, "inertial", diaginertia=words(moments), **what)
        at, kinds = frame(joint), KINDS[joint.get("type")]
        for k, kind in enumerate(kinds):
            how = {"name": joint.get("name") + "b" * k, "type": kind, "pos": words(at[:3, 3])}
            if kind != "ball":
                how["axis"] = words(at[:3, :3] @ numbers(joint.find(f"axis{'2' * k}/xyz")))
            Xml.SubElement(body, "joint", **how)
    for joint in joints:  # a site where each joint is on its child
        Xml.SubElement(bodies[joint.findtext("child")], "site", name=joint.get("name"), pos=words(frame(joint)[:3, 3]))
    for joint in closing:
        at, kind = frame(joint), joint.get("type")
        assert kind in {"ball", "revolute"}, kind
        points = [at[:3, 3]]
        if kind == "revolute":
            points.append(points[0] + ASIDE * at[:3, :3] @ numbers(joint.find("axis/xyz")))
        for point in points:
            pair = {"body1": joint.findtext("child"), "body2": joint.findtext("parent")}
            Xml.SubElement(loops, "connect", anchor=words(point), **pair)
    tip = model.find("frame")
    Xml.SubElement(bodies[tip.get("attached_to")], "site", name="tip", pos=words(frame(tip)[:3, 3]))
    return Xml.tostring(root, encoding="unicode")


def numbers(element: Xml.Element) -> np.ndarray:
    return np.array([float(word) for word in element.text.split()])


def words(values: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in values)


def frame(element: Xml.Element) -> np.ndarray:
    """The matrix (4, 4) of an element's pose; roll, pitch and yaw turn about fixed axes, in this order."""
    pose = element.find("pose")
    x = np.zeros(6) if pose is None else numbers(pose)
    matrix = np.eye(4)
    for angle, (a, b) in zip(x[3:], ((1, 2), (2, 0), (0, 1)), strict=True):
        turn = np.eye(4)
        turn[a, a] = turn[b, b] = np.cos(angle)
        turn[a, b], turn[b, a] = -np.sin(angle), np.sin(angle)
        matrix = turn @ matrix
    matrix[:3, 3] = x[:3]
    return matrix


def posed(matrix: np.ndarray) -> dict[str, str]:
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(matrix[:3, :3]).ravel())
    return {"pos": words(matrix[:3, 3]), "quat": words(quaternion)}
