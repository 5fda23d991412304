// The live page: the part is dragged or placed by numbers; the server that sent the page judges it, and plans again there.
import { Euler, Matrix4, Object3D, Quaternion, Vector3 } from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import { element, ramp, rgb, swatch } from "./theme.js";

const ASK_MS = 400; // between two questions how far a plan is
const DIGITS = [3, 3, 3, 4, 4, 4]; // of the placement in numbers: mm and degrees
const $ = (id) => document.getElementById(id);

export class Live {
  constructor(page, arrays, view, motion, clock) {
    const data = page.live, points = arrays.rows(data.points);
    Object.assign(this, { data, view, motion, clock, joints: motion?.joints, isTilted: false, asked: 0 });
    this.plan = matrixOf(data.placement);
    this.middle = new Vector3(...data.middle);
    this.anchor = new Object3D(); // the part's middle; the handles hold it
    this.anchor.position.copy(this.middle);
    this.colours = ramp(data.ramp);
    if (view) this._addTo(view, points);
    this._onPanel();
    if (self !== top) this._becomeFramed();
    fold();
    this._moved(true);
    this._follow();
  }

  /** The path that is coloured by its margins, and the handles. */
  _addTo(view, points) {
    const ends = new Float32Array(2 * (points.length - 3));
    for (let k = 0; k + 3 < points.length; k += 3) ends.set(points.subarray(k, k + 6), 2 * k);
    this.path = new LineSegments2(new LineSegmentsGeometry().setPositions(ends), new LineMaterial({ vertexColors: true, linewidth: 2.6 }));
    this.path.geometry.setColors(new Float32Array(ends.length).fill(0.4));
    view.part.add(this.path);
    view.scene.add(this.anchor);
    this.handles = new TransformControls(view.camera, view.canvas);
    this.handles.attach(this.anchor);
    this.handles.setSize(0.75);
    view.scene.add(this.handles.getHelper());
    this.handles.addEventListener("change", () => view.ask());
    this.handles.addEventListener("dragging-changed", ({ value }) => {
      view.controls.enabled = !value;
      if (!value) this._moved(true);
    });
    this.handles.addEventListener("objectChange", () => this._moved(false));
  }

  /** In a frame of the page that compares runs: the scene alone, without handles. */
  _becomeFramed() {
    document.body.classList.add("framed");
    if (!this.handles) return;
    this.handles.enabled = false;
    this.handles.getHelper().visible = false;
  }

  _onPanel() {
    const buttons = [...document.querySelectorAll("[data-handles]")];
    for (const button of buttons) button.addEventListener("click", () => {
      buttons.forEach((each) => each.setAttribute("aria-pressed", each === button));
      this.handleMode = button.dataset.handles;
      if (!this.handles) return;
      this.handles.enabled = Boolean(this.handleMode);
      this.handles.getHelper().visible = this.handles.enabled;
      if (this.handleMode) this.handles.setMode(this.handleMode);
      this.view.ask();
    });
    this.typed = [...document.querySelectorAll("[data-typed]")];
    for (const input of this.typed) input.addEventListener("change", () => this._byNumbers());
    $("tilted")?.addEventListener("change", () => { this.isTilted = $("tilted").checked; this._judge(true); });
    $("back").addEventListener("click", () => this.place(this.data.placement));
    $("touch-off").addEventListener("click", () => this._try("placement-news", async () => {
      const { name, text } = await this.ask("touch-off", { placement: this.placement });
      const link = element("a", { download: name, href: URL.createObjectURL(new Blob([text], { type: "text/csv" })) });
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
      return `${name}: three points of the part, with the legs there.`;
    }));
    $("open-placement").addEventListener("click", () => $("placement-file").click());
    $("placement-file").addEventListener("change", () => this._try("placement-news", async () => {
      const [file] = $("placement-file").files;
      if (!file) return "";
      const { placement } = await this.ask("placement", { text: await file.text(), name: file.name });
      $("placement-file").value = "";
      this.place(placement);
      return `The part is where ${file.name} has it.`;
    }));
    $("plan").addEventListener("click", () => this._try("stage-now", async () => { this._follow(await this.ask("plan", { placement: this.placement })); }));
    $("cancel").addEventListener("click", () => this._try("stage-now", async () => { this._tell(await this.ask("cancel")); }));
  }

  /** Ask the server; throws what it says against it. */
  async ask(name, content = {}) {
    let answer;
    try {
      answer = await fetch(`${this.data.base}/${name}`, {
        method: "POST", body: JSON.stringify(content),
        headers: { "X-Pentapod-Token": this.data.token, "Content-Type": "application/json" },
      });
    } catch {
      throw new Error("The viewer does not answer: was pentapod view ended?");
    }
    if (answer.status === 403) throw new Error(await answer.text());
    const said = await answer.json();
    if (!answer.ok) throw new Error(said.error);
    return said;
  }

  async _try(place, work) {
    try {
      $(place).textContent = (await work()) ?? $(place).textContent;
    } catch (error) {
      if (place === "stage-now") $("planning").hidden = false;
      $(place).textContent = error.message;
    }
  }

  /** Where the part is: its motion from where it was planned. */
  get delta() {
    const { anchor, middle } = this;
    return new Matrix4().compose(anchor.position, anchor.quaternion, new Vector3(1, 1, 1)).multiply(new Matrix4().makeTranslation(middle.clone().negate()));
  }

  /** The placement: its rotation row by row, and its translation, mm. */
  get placement() {
    const e = this.delta.multiply(this.plan).elements;
    return [e[0], e[4], e[8], e[1], e[5], e[9], e[2], e[6], e[10], e[12], e[13], e[14]];
  }

  /** Put the part at a placement. */
  place(numbers) {
    const delta = matrixOf(numbers).multiply(this.plan.clone().invert());
    this.anchor.quaternion.copy(new Quaternion().setFromRotationMatrix(delta)).normalize();
    this.anchor.position.copy(this.middle).applyMatrix4(delta);
    this._moved(true);
  }

  _byNumbers() {
    const values = this.typed.map((input) => input.valueAsNumber);
    if (values.some((value) => !Number.isFinite(value))) return this._showNumbers();
    const [x, y, z, ...turns] = values;
    const [a, b, c] = turns.map((turn) => (turn * Math.PI) / 180);
    const e = new Matrix4().makeRotationFromEuler(new Euler(a, b, c, "ZYX")).elements; // about the fixed x, then y, then z
    this.place([e[0], e[4], e[8], e[1], e[5], e[9], e[2], e[6], e[10], x, y, z]);
  }

  _showNumbers() {
    const matrix = this.delta.multiply(this.plan), turn = new Euler().setFromRotationMatrix(matrix, "ZYX");
    const values = [...new Vector3().setFromMatrixPosition(matrix).toArray(), ...[turn.x, turn.y, turn.z].map((angle) => (angle * 180) / Math.PI)];
    this.typed.forEach((input, k) => { input.value = String(Number(values[k].toFixed(DIGITS[k])) + 0); });
  }

  /** The part was moved; isThere: it was let go. */
  _moved(isThere) {
    this.view?.movePart(this.delta);
    this._showNumbers();
    this._showMotion(this.joints, false);
    this._judge(isThere);
  }

  /** joints: of the motion, where the part is now (areThere) or where it was planned. */
  _showMotion(joints, areThere) {
    if (!this.motion) return;
    Object.assign(this.motion, { joints, areThere });
    if (this.clock.listeners.length) this.clock.set(this.clock.now);
  }

  /** Ask for the margins of the latest placement; those passed meanwhile are skipped. */
  async _judge(isThorough) {
    this.wanted = { thorough: isThorough };
    if (this.isAsking) return;
    this.isAsking = true;
    try {
      while (this.wanted) {
        const { thorough } = this.wanted, placement = this.placement;
        this.wanted = null;
        const begun = performance.now(), reach = await this.ask("margins", { placement, thorough, tilted: this.isTilted });
        (this.lasted ??= []).push([thorough, performance.now() - begun]);
        this._show(reach);
        if (thorough && !this.wanted && this.joints?.length) {
          const { joints } = await this.ask("joints", { placement });
          if (!this.wanted) this._showMotion(Float32Array.from(joints), true);
        }
      }
      document.documentElement.dataset.judged = ++this.asked;
    } catch (error) {
      $("reach").textContent = error.message;
      $("reach").className = "reach bad";
    } finally {
      this.isAsking = false;
    }
  }

  _show({ fits, text, step, margins }) {
    $("reach").textContent = text;
    $("reach").className = fits ? "reach good" : "reach bad";
    if (!this.path) return;
    const { comfortable, beyond } = this.data, ink = rgb(beyond), out = new Float32Array(6 * (margins.length - 1));
    const colours = margins.map((steps) => (steps < 0 ? ink : this.colours((steps * step) / comfortable)).map(linear));
    for (let k = 0; k + 1 < colours.length; k++) { out.set(colours[k], 6 * k); out.set(colours[k + 1], 6 * k + 3); }
    this.path.geometry.setColors(out);
    this.view.ask();
  }

  /** Show the legs that are beyond their strokes. */
  mark(legs) {
    const [shortest, longest] = this.data.strokes;
    if (legs?.length) this.view.machine.mark(legs.map((leg, k) => leg < shortest[k] - 0.01 || leg > longest[k] + 0.01), this.data.tooFar);
  }

  /** Colour the path by the margins here, or leave it to the page; returns whether. */
  paint(kind, legend) {
    const isHere = kind === "live", { data } = this;
    if (this.path) {
      this.path.visible = isHere;
      if (this.view.path) this.view.path.cuts.visible = !isHere;
      this.view.ask();
    }
    if (!isHere) return false;
    const bar = element("span", { className: "ramp" });
    bar.style.background = `linear-gradient(90deg, ${data.ramp.map(([at, hex]) => `${hex} ${100 * at}%`).join(", ")})`;
    const ends = ["0, at a limit", `margin ${data.comfortable} or more`].map((text) => element("span", { textContent: text }));
    legend.replaceChildren(bar, element("span", { className: "ends" }, ...ends), element("span", {}, swatch(data.beyond), "beyond a limit"));
    return true;
  }

  /** Tell how far a plan is until it ends; then the page shows the new run. */
  async _follow(state) {
    try {
      let now = state ?? (await this.ask("state"));
      const wasPlanning = now.plans;
      for (; now.plans; now = await this.ask("state")) {
        this._tell(now);
        await new Promise((later) => { setTimeout(later, ASK_MS); });
      }
      this._tell(now);
      if (wasPlanning && now.news.isNew) location.reload();
    } catch (error) {
      $("planning").hidden = false;
      $("stage-now").textContent = error.message;
    }
  }

  _tell({ plans, ends, stage, share, note, news }) {
    $("plan").disabled = plans;
    $("cancel").hidden = !plans;
    $("cancel").disabled = ends;
    $("planning").hidden = !plans;
    if (share > 0) $("planned").value = share;
    else $("planned").removeAttribute("value");
    $("stage-now").textContent = ends ? "It is being cancelled." : `${stage}${share > 0 ? ` ${Math.round(100 * share)} %` : ""}${note ? `: ${note}` : ""}`;
    $("news").replaceChildren(...(news.text ? [element("p", { textContent: news.text, className: news.passed ? "good" : "bad" })] : []), ...(news.toml ? [element("pre", { textContent: news.toml })] : []));
  }
}

/** A colour of the screen in the renderer's own space. */
const linear = (part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4);

const matrixOf = ([a, b, c, d, e, f, g, h, i, x, y, z]) => new Matrix4().set(a, b, c, x, d, e, f, y, g, h, i, z, 0, 0, 0, 1);

/** Fold the sections of the report below the scene. */
function fold() {
  for (const section of document.querySelectorAll("main section:not(#motion)")) {
    const title = section.querySelector("h2");
    if (!title) continue;
    const details = element("details", { className: "fold" }, element("summary", {}, title));
    details.append(...section.childNodes);
    section.append(details);
  }
}
