// Two runs side by side: their pages in frames, of which only the scenes are shown, with one clock and one point of view.
import { Clock } from "./motion.js";

const $ = (id) => document.getElementById(id);

export async function compare() {
  const reports = await Promise.all([...document.querySelectorAll("iframe")].map(drawn));
  const clock = new Clock(Math.max(...reports.map((report) => report.clock.duration)));
  $("slider").max = clock.duration;
  clock.listeners.push((now) => {
    for (const report of reports) report.clock.set(now); // one that is shorter stays at its end
    $("slider").value = now;
    $("clock").textContent = `${now.toFixed(2)} s`;
  });
  clock.onRun = (isRunning) => {
    $("play").textContent = isRunning ? "❚❚ pause" : "▶ play";
    $("play").setAttribute("aria-pressed", isRunning);
  };
  $("slider").addEventListener("input", () => clock.go(Number($("slider").value)));
  $("play").addEventListener("click", () => clock.toggle());
  $("speed").addEventListener("change", () => { clock.speed = Number($("speed").value); });
  const views = reports.map((report) => report.view).filter(Boolean);
  for (const view of views) view.controls.addEventListener("change", () => views.forEach((other) => other !== view && follow(other, view)));
  for (const button of document.querySelectorAll("[data-look]")) button.addEventListener("click", () => views.forEach((view) => view.look(button.dataset.look)));
  clock.set(0);
  Object.assign(window, { comparison: { clock, reports } });
  document.documentElement.dataset.ready = Math.round(performance.now());
}

/** The report of a frame, once it is drawn. While it loads, its document has no element at times. */
async function drawn(frame) {
  while (!frame.contentDocument?.documentElement?.dataset.drawn) await new Promise((later) => { setTimeout(later, 50); });
  return frame.contentWindow.report;
}

function follow(view, leader) {
  view.camera.position.copy(leader.camera.position);
  view.controls.target.copy(leader.controls.target);
  view.camera.lookAt(view.controls.target);
  view.ask();
}
