// Bodies: rods, bodies of revolution, tools, meshes with sharp edges.
import {
  BufferAttribute, BufferGeometry, CanvasTexture, DoubleSide, LatheGeometry, Mesh, MeshLambertMaterial, SphereGeometry,
  Sprite, SpriteMaterial, SRGBColorSpace, Vector2, Vector3,
} from "three";

export const Z = new Vector3(0, 0, 1);

const CREASE = Math.cos((35 * Math.PI) / 180); // facets that meet at more keep their edge

export const matt = (color, more = {}) => new MeshLambertMaterial({ color, ...more });

/** A body of revolution about z. profile: [radius, height], upwards. */
export function turned(profile, material, around = 32) {
  const shape = new LatheGeometry(profile.map(([r, h]) => new Vector2(Math.max(r, 0), h)), around);
  return new Mesh(shape.rotateX(Math.PI / 2), material); // the axis of a lathe is y
}

/** A cylinder about z with flat ends. */
export const rod = (radius, low, high, material, around = 24) =>
  turned([[0, low], [radius, low], [radius, low], [radius, high], [radius, high], [0, high]], material, around);

export const ball = (radius, material) => new Mesh(new SphereGeometry(radius, 24, 16), material);

/** Outline of a frustum thickened by a ball, as all solids of tools are, from the lowest to the highest point. */
export function outline({ low, high, lowRadius, highRadius, rounding }) {
  const tall = high - low, lean = tall > 0 ? Math.atan2(lowRadius - highRadius, tall) : 0, steps = rounding > 0 ? 10 : 1;
  const arc = (from, to, radius, height) => Array.from({ length: steps + 1 }, (_, k) => {
    const angle = from + ((to - from) * k) / steps;
    return [radius + rounding * Math.cos(angle), height + rounding * Math.sin(angle)];
  });
  const quarter = Math.PI / 2;
  return [[0, low - rounding], ...arc(-quarter, lean, lowRadius, low), ...arc(lean, quarter, highRadius, high), [0, high + rounding]];
}

/** Put a body that lies along +z from 0 between two points; returns their distance. */
export function span(body, from, to) {
  const way = to.clone().sub(from), length = way.length();
  body.position.copy(from);
  body.quaternion.setFromUnitVectors(Z, way.multiplyScalar(1 / Math.max(length, 1e-9)));
  return length;
}

/** A number in a disc that always faces the viewer. */
export function badge(text, ink) {
  const canvas = Object.assign(document.createElement("canvas"), { width: 64, height: 64 }), pen = canvas.getContext("2d");
  pen.fillStyle = ink;
  pen.beginPath();
  pen.arc(32, 32, 31, 0, 2 * Math.PI);
  pen.fill();
  pen.fillStyle = "#ffffff";
  pen.font = "bold 42px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(text, 32, 35);
  const map = new CanvasTexture(canvas);
  map.colorSpace = SRGBColorSpace;
  const sprite = new Sprite(new SpriteMaterial({ map, sizeAttenuation: false, depthTest: false, transparent: true }));
  sprite.scale.setScalar(0.023);
  return sprite;
}

/** A mesh from coordinates and indices; vertices on sharp edges are split, so that edges are seen. */
export function surface(vertices, faces, ink, opacity) {
  const shape = creased(vertices, faces);
  const material = matt(ink, { side: DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 2 });
  if (opacity < 1) Object.assign(material, { transparent: true, opacity, depthWrite: false });
  return new Mesh(shape, material);
}

function creased(vertices, faces) {
  const corners = faces.length, count = vertices.length / 3, flat = facetNormals(vertices, faces);
  const mean = new Float32Array(3 * count), sharp = new Uint8Array(count), facet = (c) => 3 * Math.floor(c / 3);
  for (let c = 0; c < corners; c++) for (let d = 0; d < 3; d++) mean[3 * faces[c] + d] += flat.sum[facet(c) + d];
  for (let v = 0; v < mean.length; v += 3) unit(mean, v);
  const bent = Math.sqrt((1 + CREASE) / 2); // half the angle, from the mean
  for (let c = 0; c < corners; c++) if (dot(mean, 3 * faces[c], flat.unit, facet(c)) < bent) sharp[faces[c]] = 1;
  const split = faces.reduce((sum, v) => sum + sharp[v], 0), places = new Float32Array(vertices.length + 3 * split);
  const normals = new Float32Array(places.length), index = new Uint32Array(faces);
  places.set(vertices);
  normals.set(mean);
  let next = count;
  if (split) {
    const around = facetsAround(faces, count);
    for (let c = 0; c < corners; c++) {
      const v = faces[c], at = 3 * next;
      if (!sharp[v]) continue;
      for (let d = 0; d < 3; d++) places[at + d] = vertices[3 * v + d];
      for (let k = around.start[v]; k < around.start[v + 1]; k++) {
        const other = 3 * around.facet[k];
        if (dot(flat.unit, facet(c), flat.unit, other) >= CREASE) for (let d = 0; d < 3; d++) normals[at + d] += flat.sum[other + d];
      }
      unit(normals, at);
      index[c] = next++;
    }
  }
  const shape = new BufferGeometry();
  shape.setAttribute("position", new BufferAttribute(places, 3));
  shape.setAttribute("normal", new BufferAttribute(normals, 3));
  shape.setIndex(new BufferAttribute(index, 1));
  return shape;
}

const dot = (a, i, b, j) => a[i] * b[j] + a[i + 1] * b[j + 1] + a[i + 2] * b[j + 2];

function unit(a, i) {
  const length = Math.hypot(a[i], a[i + 1], a[i + 2]) || 1;
  for (let d = 0; d < 3; d++) a[i + d] /= length;
}

/** Normals of facets, as long as twice their areas (sum) and of length one (unit). */
function facetNormals(v, faces) {
  const sum = new Float32Array(faces.length);
  for (let f = 0; f < faces.length; f += 3) {
    const [a, b, c] = [3 * faces[f], 3 * faces[f + 1], 3 * faces[f + 2]];
    const [ux, uy, uz] = [v[b] - v[a], v[b + 1] - v[a + 1], v[b + 2] - v[a + 2]];
    const [wx, wy, wz] = [v[c] - v[a], v[c + 1] - v[a + 1], v[c + 2] - v[a + 2]];
    sum[f] = uy * wz - uz * wy;
    sum[f + 1] = uz * wx - ux * wz;
    sum[f + 2] = ux * wy - uy * wx;
  }
  const one = sum.slice();
  for (let f = 0; f < one.length; f += 3) unit(one, f);
  return { sum, unit: one };
}

/** For each vertex the facets that have it: facet[start[v]] … facet[start[v + 1] − 1]. */
function facetsAround(faces, count) {
  const start = new Uint32Array(count + 1), facet = new Uint32Array(faces.length);
  for (const v of faces) start[v + 1]++;
  for (let v = 0; v < count; v++) start[v + 1] += start[v];
  const next = start.slice();
  faces.forEach((v, c) => { facet[next[v]++] = Math.floor(c / 3); });
  return { start, facet };
}
