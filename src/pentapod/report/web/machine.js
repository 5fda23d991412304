// The machine as solids: base, legs that slide, spindle, tool and passive limb, in millimetres of the machine's frame.
import { DoubleSide, Group, Vector3 } from "three";
import { badge, ball, matt, outline, rod, span, surface, turned, Z } from "./solids.js";

const INK = { base: "#7d8794", rod: "#d7dce2", spindle: "#98a1ad", nose: "#6c7480", limb: "#8a8f98" };
const TOOL = { cutter: "#c8b26a", shank: "#d7c78f", holder: "#5f6772" };

export class Machine extends Group {
  /** data: the page's `scene.machine`. */
  constructor(data) {
    super();
    this.data = data;
    this.bases = data.base.map((at) => new Vector3(...at));
    this._addBase();
    this.legs = data.legs.map((leg, k) => this._addLeg(leg, k));
    this.tool = this._addTool();
    if (data.limb) this._addLimb();
  }

  _addBase() {
    const { rim, legs, up, legRadius } = this.data, wide = Math.max(0.05 * rim.radius, 2.5 * legRadius), thick = 0.02 * rim.radius;
    const [inner, outer] = [rim.radius - wide / 2, rim.radius + wide / 2];
    const ring = turned([[inner, 0], [outer, 0], [outer, 0], [outer, thick], [outer, thick], [inner, thick], [inner, thick], [inner, 0]], matt(INK.base, { side: DoubleSide }), 96);
    const away = new Vector3(...rim.normal).normalize();
    if (away.z * up < 0) away.negate(); // above what hangs from it, below what stands on it
    ring.quaternion.setFromUnitVectors(Z, away);
    ring.position.set(...rim.centre).addScaledVector(away, 1.6 * legRadius);
    this.add(ring);
    this.bases.forEach((at, k) => {
      const joint = ball(1.8 * legRadius, matt(legs[k].colour)), name = badge(`${k + 1}`, legs[k].colour);
      joint.position.copy(at);
      name.position.copy(at).addScaledVector(away, thick + 6 * legRadius);
      this.add(joint, name);
    });
  }

  _addLeg({ colour, sleeve }, k) {
    const r = this.data.legRadius, leg = new Group(), inner = rod(0.6 * r, 0, 1, matt(INK.rod)), joint = ball(1.6 * r, matt(colour));
    leg.add(rod(r, 0, sleeve, matt(colour)), inner);
    const arm = this.data.beside.includes(k) ? rod(0.8 * r, 0, 1, matt(colour)) : null;
    this.add(leg, joint);
    if (arm) this.add(arm);
    return { leg, inner, joint, arm, sleeve };
  }

  _addTool() {
    const { spindle, solids } = this.data, { radius, low, high } = spindle, tool = new Group(), nose = Math.min(1.2 * radius, 0.25 * (high - low));
    const metal = (ink) => matt(ink, { side: DoubleSide });
    tool.add(rod(radius, low + nose, high, metal(INK.spindle), 32));
    tool.add(turned([[0, low], [0.6 * radius, low], [0.6 * radius, low], [radius, low + nose]], metal(INK.nose)));
    for (const solid of solids) tool.add(turned(outline(solid), metal(TOOL[solid.kind])));
    this.add(tool);
    return tool;
  }

  _addLimb() {
    const { rail, radius } = this.data.limb, [from, to] = rail.map((at) => new Vector3(...at)), bar = rod(0.8 * radius, 0, 1, matt(INK.limb));
    bar.scale.z = span(bar, from, to);
    this.carriage = ball(1.6 * radius, matt(INK.nose));
    this.strut = rod(radius, 0, 1, matt(INK.limb));
    this.along = to.clone().sub(from).normalize();
    this.railStart = from;
    this.add(bar, this.strut, this.carriage);
  }

  /** Put the machine at a tip and an axis; joints: by leg, of those beside the spindle. Returns the lengths of the legs. */
  pose(tip, axis, joints = []) {
    const at = new Vector3(...tip), along = new Vector3(...axis), { heights, beside, limb } = this.data;
    const above = (height) => at.clone().addScaledVector(along, height);
    this.tool.position.copy(at);
    this.tool.quaternion.setFromUnitVectors(Z, along);
    if (limb) {
      const end = above(limb.height), foot = this.railStart.clone().addScaledVector(this.along, end.clone().sub(this.railStart).dot(this.along));
      this.strut.scale.z = span(this.strut, foot, end);
      this.carriage.position.copy(foot);
    }
    return this.legs.map(({ leg, inner, joint, arm, sleeve }, k) => {
      const n = beside.indexOf(k), foot = above(heights[k]), end = n < 0 ? foot : new Vector3(...joints.slice(3 * n, 3 * n + 3));
      const length = span(leg, this.bases[k], end);
      inner.position.z = sleeve;
      inner.scale.z = Math.max(length - sleeve, 1e-3);
      joint.position.copy(end);
      if (arm) arm.scale.z = Math.max(span(arm, foot, end), 1e-3);
      return length;
    });
  }

  /** Show which legs are beyond their strokes. */
  mark(areBeyond, ink) {
    this.legs.forEach(({ leg }, k) => leg.children[0].material.color.set(areBeyond[k] ? ink : this.data.legs[k].colour));
  }

  /** Points that hold the base and the platform where it is, for the views. */
  get bounds() {
    const { rim } = this.data, away = new Vector3(...rim.normal).normalize(), side = new Vector3(1, 0, 0).projectOnPlane(away).normalize();
    const other = new Vector3().crossVectors(away, side);
    const joints = this.legs.map(({ joint }) => joint.position.clone());
    return joints.concat(Array.from({ length: 24 }, (_, k) => {
      const turn = (k * Math.PI) / 12, r = 1.12 * rim.radius;
      return new Vector3(...rim.centre).addScaledVector(side, r * Math.cos(turn)).addScaledVector(other, r * Math.sin(turn));
    }));
  }
}

/** The table as a plate, its upper face at a height. */
export function plate({ z, centre, half, thick }, up) {
  const [x, y] = centre, low = z - up * thick, corner = [];
  for (const height of [low, z]) for (const [a, b] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) corner.push(x + a * half, y + b * half, height);
  const sides = [0, 1, 2, 0, 2, 3, 4, 6, 5, 4, 7, 6, 0, 5, 1, 0, 4, 5, 1, 6, 2, 1, 5, 6, 2, 7, 3, 2, 6, 7, 3, 4, 0, 3, 7, 4];
  return surface(new Float32Array(corner), new Uint32Array(sides), "#a08a6a", 1);
}
