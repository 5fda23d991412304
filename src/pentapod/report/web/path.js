// The tool path: cuts coloured key by key, links and rapids, and still lines and dots.
import { BufferAttribute, BufferGeometry, Color, Group, LineBasicMaterial, LineSegments, Points, PointsMaterial } from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import { rgb } from "./theme.js";

const LIFT = 0.4; // mm, along the tool axis: the tip of a ball runs on and below the surface, which would hide it
const MOST_WIDE = 30_000; // segments; a wide line has eight corners a segment, too many beyond without a graphics card
const CUT = 0;

const plain = (points) => new BufferGeometry().setAttribute("position", new BufferAttribute(points, 3));

export class Path extends Group {
  /** tips, axes: of the keys, side by side; kinds: 0 for cuts. */
  constructor({ tips, axes, kinds }) {
    super();
    this.lifted = tips.map((value, k) => value + LIFT * axes[k]);
    const isCut = (k) => kinds[k] === CUT && kinds[k + 1] === CUT;
    const keys = Array.from({ length: Math.max(kinds.length - 1, 0) }, (_, k) => k);
    this.keys = keys.filter(isCut); // the first key of each segment that is drawn
    this.isWide = this.keys.length <= MOST_WIDE;
    const points = this._ends(this.keys);
    this.cuts = this.isWide
      ? new LineSegments2(new LineSegmentsGeometry().setPositions(points), new LineMaterial({ vertexColors: true, linewidth: 2.2 }))
      : new LineSegments(plain(points), new LineBasicMaterial({ vertexColors: true }));
    this.others = new LineSegments(plain(this._ends(keys.filter((k) => !isCut(k)))), new LineBasicMaterial({ color: "#7c8592", transparent: true, opacity: 0.7 }));
    this.others.visible = false;
    this.add(this.cuts, this.others);
  }

  _ends(keys) {
    const points = new Float32Array(6 * keys.length);
    keys.forEach((k, n) => points.set(this.lifted.subarray(3 * k, 3 * k + 6), 6 * n));
    return points;
  }

  /** colours: red, green, blue, each 0 to 1, of each key; a segment has that of its first, so that causes keep apart. */
  paint(colours) {
    const out = new Float32Array(6 * this.keys.length), colour = new Color();
    this.keys.forEach((k, n) => {
      colour.setRGB(colours[3 * k], colours[3 * k + 1], colours[3 * k + 2], "srgb").toArray(out, 6 * n);
      colour.toArray(out, 6 * n + 3);
    });
    if (this.isWide) this.cuts.geometry.setColors(out);
    else this.cuts.geometry.setAttribute("color", new BufferAttribute(out, 3));
  }

  /** The key at which the segment of a hit begins. */
  keyOf(hit) { return this.keys[this.isWide ? hit.faceIndex : hit.index >> 1]; }
}

/** Lines along points; runs: where each line begins. */
export function polylines(points, runs, ink, width) {
  const ends = [], starts = new Set(runs), count = points.length / 3;
  for (let k = 0; k + 1 < count; k++) if (!starts.has(k + 1)) for (let d = 0; d < 6; d++) ends.push(points[3 * k + d]);
  const shape = new Float32Array(ends);
  if (width <= 1 || shape.length > 6 * MOST_WIDE) return new LineSegments(plain(shape), new LineBasicMaterial({ color: ink }));
  return new LineSegments2(new LineSegmentsGeometry().setPositions(shape), new LineMaterial({ color: ink, linewidth: width }));
}

export const dots = (points, ink) =>
  new Points(plain(points), new PointsMaterial({ color: new Color(...rgb(ink)).convertSRGBToLinear(), size: 6, sizeAttenuation: false }));
