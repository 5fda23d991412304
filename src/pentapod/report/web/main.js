// The page's script: scene and plots follow one clock, which slider, links, clicks and keys move.
import { compare } from "./compare.js";
import { Live } from "./live.js";
import { Clock, Motion } from "./motion.js";
import { Plots } from "./plots.js";
import { legend, scaleOf, Told } from "./readout.js";
import { View } from "./scene.js";
import { element, setPaper } from "./theme.js";
import { Arrays } from "./unpack.js";

const PAPER_PX = 700; // A4 less its margins
const SLOW_MS = 45, SLOW_FRAMES = 5, COARSE = [0.7, 0.45]; // slow graphics draw fewer pixels while the machine moves

const $ = (id) => document.getElementById(id);
const all = (selector, act) => document.querySelectorAll(selector).forEach(act);

async function begin() {
  const started = performance.now(), page = JSON.parse($("page").textContent);
  const arrays = await Arrays.of($("arrays").textContent, page.arrays);
  const motion = page.motion ? new Motion(page.motion, arrays) : null, clock = new Clock(motion?.duration ?? 0);
  if (page.compare) return compare();
  const view = page.scene ? viewOf(page.scene, arrays, motion) : null, live = page.live ? new Live(page, arrays, view, motion, clock) : null;
  Object.assign(window, { report: { page, arrays, motion, clock, view, live } }); // for the console, and for tests
  if (page.scene) onScene(page, view);
  if (motion) onMotion(page, motion, clock, view, live);
  if (motion) clock.set(page.motion.start);
  view?.look("machine");
  view?.draw();
  document.documentElement.dataset.pictured = Math.round(performance.now()); // since the address was opened
  document.documentElement.dataset.drawn = Math.round(performance.now() - started);
  await new Promise((later) => { setTimeout(later); }); // the picture first
  const plots = page.plots ? new Plots($("plots"), page.plots, arrays, motion && ((time) => clock.go(time))) : null;
  window.report.plots = plots;
  if (plots) onPlots(plots, motion, clock);
  onPaper(plots, view);
  document.documentElement.dataset.ready = Math.round(performance.now());
}

/** The scene; where there is no WebGL a sentence, and the drawings and plots remain. */
function viewOf(scene, arrays, motion) {
  try {
    return new View($("canvas"), scene, arrays, motion);
  } catch (error) {
    $("stage").hidden = true; // its size and its legend are asked for, still
    $("stage").before(element("p", { className: "hint", textContent: "This browser has no WebGL: the machine cannot be shown in 3D. Drawings, plots and numbers do not need it." }));
    console.info(error.message);
    return null;
  }
}

function onScene(page, view) {
  if (!view) return all("[data-look], #layers", (node) => { node.hidden = true; });
  const fit = () => view.resize($("stage").clientWidth, $("stage").clientHeight);
  view.fit = fit;
  fit();
  new ResizeObserver(fit).observe($("stage"));
  all("[data-look]", (button) => button.addEventListener("click", () => view.look(button.dataset.look)));
  for (const [name, body] of [...view.named, ...(view.path ? [["links and rapids", view.path.others]] : [])]) {
    const box = element("input", { type: "checkbox", checked: body.visible });
    box.addEventListener("change", () => { body.visible = box.checked; view.ask(); });
    const ink = [...page.scene.lines, ...page.scene.dots].find((each) => each.name === name)?.colour;
    const label = element("label", {}, box, name);
    if (ink) label.style.setProperty("--swatch", ink);
    $("layers").append(label);
  }
  const { controls } = view, keys = {
    ArrowLeft: () => controls.rotateLeft(0.12), ArrowRight: () => controls.rotateLeft(-0.12), ArrowUp: () => controls.rotateUp(0.12),
    ArrowDown: () => controls.rotateUp(-0.12), "+": () => controls.dollyIn(1.15), "=": () => controls.dollyIn(1.15), "-": () => controls.dollyOut(1.15),
  };
  $("canvas").addEventListener("keydown", (event) => {
    if (!(event.key in keys)) return;
    event.preventDefault();
    keys[event.key]();
    controls.update();
    view.ask();
  });
}

function onMotion(page, motion, clock, view, live) {
  const slider = $("slider"), told = new Told($("told"), page.motion, motion);
  slider.max = motion.duration;
  let frames = 0;
  clock.listeners.push((now) => {
    const state = motion.at(now), legs = view?.pose(state.tip, state.axis, state.joints, motion.areThere);
    live?.mark(legs);
    slider.value = now;
    $("clock").textContent = `${now.toFixed(2)} s`;
    if (!clock.isRunning || frames++ % 6 === 0) slider.setAttribute("aria-valuetext", told.show(state, legs)); // words less often than pictures
  });
  const paint = () => {
    if (live?.paint($("colour").value, $("legend"))) return;
    const scale = page.motion.scales.find(({ array }) => array === $("colour").value);
    view?.paint(scaleOf(scale, page.motion, motion));
    $("legend").replaceChildren(...legend(scale, page.motion));
  };
  $("colour").addEventListener("change", paint);
  paint();
  slider.addEventListener("input", () => clock.go(Number(slider.value)));
  slider.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -0.1, ArrowDown: -0.1, ArrowRight: 0.1, ArrowUp: 0.1, PageDown: -0.05 * motion.duration, PageUp: 0.05 * motion.duration }[event.key];
    if (!step) return;
    event.preventDefault();
    clock.go(clock.now + (event.shiftKey ? 10 : 1) * step);
  });
  $("play").addEventListener("click", () => clock.toggle());
  $("speed").addEventListener("change", () => { clock.speed = Number($("speed").value); });
  all("a[data-time]", (link) => link.addEventListener("click", () => clock.go(Number(link.dataset.time))));
  let coarse = 0, slow = 0;
  clock.onRun = (isRunning) => {
    $("play").textContent = isRunning ? "❚❚ pause" : "▶ play";
    $("play").setAttribute("aria-pressed", isRunning);
    if (!isRunning && coarse) { coarse = 0; view?.fit(); }
  };
  clock.onFrame = (lasted, script) => {
    (window.report.frames ??= []).push([lasted, script]);
    slow = lasted > SLOW_MS ? slow + 1 : 0;
    if (!view || slow < SLOW_FRAMES || coarse === COARSE.length) return;
    slow = 0;
    view.resize($("stage").clientWidth, $("stage").clientHeight, COARSE[coarse++]);
  };
  if (!view) return;
  let from = [0, 0];
  $("canvas").addEventListener("pointerdown", (event) => { from = [event.clientX, event.clientY]; });
  $("canvas").addEventListener("click", (event) => {
    if (Math.hypot(event.clientX - from[0], event.clientY - from[1]) > 4) return; // it was a drag
    const key = view.pick(event.clientX, event.clientY);
    if (key >= 0) clock.go(motion.times[key]);
  });
  $("canvas").addEventListener("keydown", (event) => {
    if (event.key !== " ") return;
    event.preventDefault();
    clock.toggle();
  });
}

function onPlots(plots, motion, clock) {
  all("[data-group]", (button) => button.addEventListener("click", () => {
    const isShown = button.getAttribute("aria-pressed") !== "true";
    button.setAttribute("aria-pressed", isShown);
    plots.showGroup(Number(button.dataset.group), isShown);
  }));
  $("unzoom").addEventListener("click", () => plots.all());
  plots.isWithoutMark = !motion;
  if (!motion) return all(".now", (mark) => { mark.hidden = true; });
  clock.listeners.push((now) => plots.mark(now));
  plots.mark(clock.now);
}

/** Paper is white, and as wide as it is. What is folded is opened, but for what only helps on a screen. */
function onPaper(plots, view) {
  let folded = [];
  addEventListener("beforeprint", () => {
    folded = [...document.querySelectorAll("details:not([open]):not(.method):not(.screen)")];
    folded.forEach((details) => { details.open = true; });
    setPaper(true);
    plots?.toPaper(PAPER_PX);
    plots?.redraw();
    view?.draw();
  });
  addEventListener("afterprint", () => {
    folded.forEach((details) => { details.open = false; });
    setPaper(false);
    plots?.resize();
    plots?.redraw();
  });
}

begin();
