// The scene: machine, part, fixture, table and path; drawn when something changed, looked at from where one asks.
import { AmbientLight, DirectionalLight, Group, HemisphereLight, Matrix4, PerspectiveCamera, Raycaster, Scene, Vector2, Vector3, WebGLRenderer } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { Machine, plate } from "./machine.js";
import { dots, Path, polylines } from "./path.js";
import { surface } from "./solids.js";

const NEAR_PX = 8; // of a click from the path
const ROOM = 1.07; // around what a view holds
// Where one looks from: to the right, to the front, upwards.
const VIEWS = { machine: [0.45, 1, 0.2], part: [0.45, 0.8, 0.7], above: [0, 0.001, 1], side: [0, 1, 0.02] };

export class View {
  /** canvas; data: the page's `scene`; arrays; keys: of the motion, or null. Throws where there is no WebGL. */
  constructor(canvas, data, arrays, keys) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.canvas = canvas;
    this.up = data.up;
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(28, 1, 2, 20_000);
    this.camera.up.set(0, 0, this.up); // before the controls are made: they keep it
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.ask());
    this.caster = new Raycaster();
    this.named = new Map(); // what the legend can hide
    this.part = new Group(); // what moves with the part
    this.part.matrixAutoUpdate = false;
    this.scene.add(this.part);
    this._light();
    this._fill(data, arrays, keys);
  }

  _light() {
    const sky = new HemisphereLight("#ffffff", "#7d8593", 1.6);
    sky.position.set(0, 0, this.up);
    this.scene.add(sky, new AmbientLight("#ffffff", 0.25));
    for (const [x, y, z, strength] of [[0.7, 0.9, 1, 1.5], [-1, 0.3, 0.3, 0.5]]) {
      const light = new DirectionalLight("#ffffff", strength);
      light.position.set(x, -this.up * y, this.up * z);
      this.scene.add(light);
    }
  }

  _fill(data, arrays, keys) {
    this.partPoints = [];
    this.meshes = data.meshes.map((mesh) => {
      const body = surface(arrays.rows(mesh.vertices), arrays.rows(mesh.faces, Uint32Array), mesh.colour, mesh.opacity);
      if (mesh.matrix) {
        const [a, b, c, d, e, f, g, h, i, x, y, z] = mesh.matrix;
        body.applyMatrix4(new Matrix4().set(a, b, c, x, d, e, f, y, g, h, i, z, 0, 0, 0, 1));
      }
      this._add(mesh.name, body, true, mesh.moves);
      if (mesh.isPart) this.partPoints.push(...corners(body));
      return body;
    });
    if (data.table) this._add("table", plate(data.table, this.up));
    if (data.machine) {
      this.machine = new Machine({ ...data.machine, up: this.up });
      this.scene.add(this.machine);
    }
    if (keys) this.part.add((this.path = new Path(keys)));
    for (const line of data.lines) this._add(line.name, polylines(arrays.rows(line.points), arrays.whole(line.runs), line.colour, line.width), line.shown, true);
    for (const group of data.dots) this._add(group.name, dots(arrays.rows(group.points), group.colour), group.shown, true);
    if (!this.partPoints.length) for (const body of this.named.values()) this.partPoints.push(...corners(body));
    if (!this.partPoints.length && keys) for (let k = 0; k < keys.tips.length; k += 3) this.partPoints.push(new Vector3(...keys.tips.subarray(k, k + 3)));
    if (data.pose && this.machine) this.machine.pose(data.pose.tip, data.pose.axis, data.pose.joints);
  }

  _add(name, body, isShown = true, moves = false) {
    body.visible = isShown;
    (moves ? this.part : this.scene).add(body);
    this.named.set(name, body);
  }

  show(name, isShown) { this.named.get(name).visible = isShown; this.ask(); }

  /** Put the machine at a pose of the plan, moved with the part; joints: also moved, but where they were computed there. */
  pose(tip, axis, joints, areThere = false) {
    this.ask();
    const { matrix } = this.part, at = (point) => new Vector3(...point).applyMatrix4(matrix).toArray();
    const along = new Vector3(...axis).transformDirection(matrix).toArray(), ends = [];
    for (let k = 0; k < (joints?.length ?? 0); k += 3) ends.push(...(areThere ? joints.slice(k, k + 3) : at(joints.slice(k, k + 3))));
    return this.machine?.pose(at(tip), along, ends) ?? [];
  }

  /** Move the part, and what is on it, from where it was planned. */
  movePart(matrix) {
    this.part.matrix.copy(matrix);
    this.part.matrixWorldNeedsUpdate = true;
    this.ask();
  }

  paint(colours) { this.path?.paint(colours); this.ask(); }

  /** Look from one of `VIEWS`, as near as all of it fits into the picture. */
  look(name) {
    const [right, front, above] = VIEWS[name], isWhole = this.machine && name !== "part" && name !== "above";
    const own = this.partPoints.map((point) => point.clone().applyMatrix4(this.part.matrix));
    const points = isWhole ? [...own, ...this.machine.bounds] : own;
    const back = new Vector3(right, -this.up * front, this.up * above).normalize();
    const across = new Vector3().crossVectors(this.camera.up, back).normalize(), high = new Vector3().crossVectors(back, across);
    const tall = Math.tan((this.camera.fov * Math.PI) / 360) / ROOM, wide = tall * this.camera.aspect;
    const seen = points.map((p) => [p.dot(across), p.dot(high), p.dot(back)]);
    // A point is in the picture where |its place − the camera's| ≤ (distance of the camera − its own) · tan.
    const fit = (n, tan) => {
      const most = Math.max(...seen.map((p) => p[n] + tan * p[2])), least = Math.max(...seen.map((p) => tan * p[2] - p[n]));
      return [(most - least) / 2, (most + least) / (2 * tan)];
    };
    const [x, far] = fit(0, wide), [y, farther] = fit(1, tall);
    const depth = (Math.min(...seen.map((p) => p[2])) + Math.max(...seen.map((p) => p[2]))) / 2;
    const at = (z) => across.clone().multiplyScalar(x).addScaledVector(high, y).addScaledVector(back, z);
    this.controls.target.copy(at(depth));
    this.camera.position.copy(at(Math.max(far, farther)));
    this.controls.update();
    this.ask();
  }

  /** The key of the cut at a place of the window; −1 where there is none, or the part hides it. */
  pick(clientX, clientY) {
    if (!this.path) return -1;
    const box = this.canvas.getBoundingClientRect();
    const place = new Vector2((2 * (clientX - box.left)) / box.width - 1, 1 - (2 * (clientY - box.top)) / box.height);
    this.caster.params.Line2 = { threshold: NEAR_PX };
    this.caster.params.Line.threshold = 0.6;
    this.caster.setFromCamera(place, this.camera);
    const [hit] = this.caster.intersectObject(this.path.cuts, false), [wall] = this.caster.intersectObjects(this.meshes.filter((m) => m.visible), false);
    return !hit || (wall && wall.distance < hit.distance - 4) ? -1 : this.path.keyOf(hit);
  }

  resize(width, height, ratio = Math.min(devicePixelRatio, 2)) {
    if (width < 2 || height < 2) return;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  /** Draw soon. */
  ask() {
    this.asked ??= requestAnimationFrame(() => this.draw());
  }

  /** Draw now. */
  draw() {
    cancelAnimationFrame(this.asked);
    this.asked = undefined;
    this.renderer.render(this.scene, this.camera);
  }
}

function corners(body) {
  body.geometry.computeBoundingBox();
  const { min, max } = body.geometry.boundingBox;
  body.updateMatrixWorld();
  return [0, 1, 2, 3, 4, 5, 6, 7].map((k) => new Vector3(k & 1 ? max.x : min.x, k & 2 ? max.y : min.y, k & 4 ? max.z : min.z).applyMatrix4(body.matrixWorld));
}
