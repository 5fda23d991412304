"use strict";
(() => {
  const figures = JSON.parse(document.getElementById("figures").textContent);
  const machine = JSON.parse(document.getElementById("poses").textContent);
  const drawn = {};

  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  // Colours of text and grid follow the page; the rest of a figure is the same on light and dark.
  const PAPER = { "--ink": "#000000", "--line": "#cccccc", "--sheet": "#ffffff" };
  function theme(layout, look = css) {
    const ink = look("--ink"), line = look("--line"), sheet = look("--sheet");
    const change = {
      "font.color": ink, "paper_bgcolor": "rgba(0,0,0,0)", "plot_bgcolor": "rgba(0,0,0,0)",
      "modebar.bgcolor": "rgba(0,0,0,0)", "modebar.color": line, "modebar.activecolor": ink,
      "hoverlabel.bgcolor": sheet, "hoverlabel.font.color": ink, "hoverlabel.bordercolor": line,
    };
    const axes = layout.scene ? ["scene.xaxis", "scene.yaxis", "scene.zaxis"]
      : Object.keys(layout).filter((key) => /^[xy]axis\d*$/.test(key));
    for (const axis of axes) {
      change[`${axis}.gridcolor`] = line;
      change[`${axis}.linecolor`] = line;
    }
    return change;
  }

  function draw(id) {
    const holder = document.getElementById(id);
    if (!holder || !figures[id]) return;
    const { data, layout } = figures[id];
    layout.font = { family: getComputedStyle(document.body).fontFamily, size: 12 };
    drawn[id] = Plotly.newPlot(holder, data, layout).then(() => Plotly.relayout(holder, theme(layout)));
  }

  function retheme(look = css) {
    for (const id of Object.keys(drawn)) Plotly.relayout(id, theme(figures[id].layout, look));
  }

  // Figures keep the pixels that they were drawn with: on paper they are scaled to its width (A4 less its margins).
  const PAPER_PX = 700;
  const scaling = new ResizeObserver((changes) => {
    if (matchMedia("print").matches) return;  // what is scaled already tells nothing
    for (const { target } of changes) {
      const width = target.querySelector(".svg-container")?.offsetWidth || target.clientWidth;
      target.style.setProperty("--paper", Math.min(1, PAPER_PX / width));
    }
  });

  draw("scene");
  draw("time");
  for (const holder of document.querySelectorAll(".figure")) scaling.observe(holder);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => retheme());
  // Paper cannot be opened: what is folded on the screen is printed whole.
  let folded = [];
  addEventListener("beforeprint", () => {
    folded = [...document.querySelectorAll("details:not([open])")];
    for (const details of folded) details.open = true;
    retheme((name) => PAPER[name]);  // also from a dark screen
  });
  addEventListener("afterprint", () => { for (const details of folded) details.open = false; });
  addEventListener("afterprint", () => retheme());

  const poses = machine.poses;
  if (!poses.length) return;

  const along = (p, a, s) => p.map((value, k) => value + s * a[k]);

  // The passive limb's strut: square to its rail.
  function strut(tip, axis, { origin, rail, height }) {
    const end = along(tip, axis, height);
    const place = end.reduce((sum, value, k) => sum + (value - origin[k]) * rail[k], 0);
    return [along(origin, rail, place), end];
  }

  // The ends of what moves: the legs, their arms, the strut, the platform line, the tool, the tip (in the order of the report's scene).
  function lines({ tip, axis, joints }) {
    const top = along(tip, axis, machine.line_top), nose = along(tip, axis, machine.shaft_end);
    const legs = machine.base.map((base, k) => [base, joints[k]]);
    const arms = machine.arms.map(([k, height]) => [along(tip, axis, height), joints[k]]);
    const struts = machine.limb ? [strut(tip, axis, machine.limb)] : [];
    return [...legs, ...arms, ...struts, [top, nose], [nose, tip], [tip, tip]];
  }

  const nearest = (t) => poses.reduce((best, pose, k) => Math.abs(pose.t - t) < Math.abs(poses[best].t - t) ? k : best, 0);

  const slider = document.getElementById("slider"), readout = document.getElementById("readout");
  const play = document.getElementById("play");
  slider.max = poses.length - 1;

  function show(index) {
    const pose = poses[index], ends = lines(pose), count = figures.scene.data.length;
    const coordinate = (k) => ends.map((line) => line.map((point) => point[k]));
    const traces = ends.map((_, k) => count - machine.moving + k);
    Plotly.restyle("scene", { x: coordinate(0), y: coordinate(1), z: coordinate(2) }, traces);
    const [x, y, z] = pose.tip.map((value) => value.toFixed(1));
    readout.textContent = `${pose.t.toFixed(2)} s, segment ${pose.segment}, tip (${x}, ${y}, ${z}) mm`;
    slider.value = index;
    slider.setAttribute("aria-valuetext", readout.textContent);
    if (figures.time) Plotly.relayout("time", { "shapes[0].x0": pose.t, "shapes[0].x1": pose.t });
  }

  let timer = 0;
  function stop() {
    clearInterval(timer);
    timer = 0;
    play.textContent = "▶";
    play.setAttribute("aria-label", "play");
  }
  slider.addEventListener("input", () => { stop(); show(Number(slider.value)); });
  play.addEventListener("click", () => {
    if (timer) return stop();
    play.textContent = "❚❚";
    play.setAttribute("aria-label", "pause");
    timer = setInterval(() => show((Number(slider.value) + 1) % poses.length), 80);
  });
  const near = document.getElementById("near");
  near.addEventListener("click", () => {
    const on = near.getAttribute("aria-pressed") !== "true";
    near.setAttribute("aria-pressed", on);
    // The part alone fills the view: from further back.
    const { x, y, z } = figures.scene.layout.scene.camera.eye, back = on ? 1.6 : 1.0;
    const change = { "scene.camera.eye": { x: back * x, y: back * y, z: back * z } };
    ["x", "y", "z"].forEach((name, k) => {
      change[`scene.${name}axis.${on ? "range" : "autorange"}`] = on ? machine.around[k] : true;
    });
    Plotly.relayout("scene", change);
  });
  drawn.scene.then(() => show(machine.start));
  if (drawn.time) {
    drawn.time.then((holder) => holder.on("plotly_click", (event) => {
      stop();
      show(nearest(event.points[0].x));
    }));
  }
  for (const link of document.querySelectorAll("a.go")) {
    link.addEventListener("click", () => { stop(); show(nearest(Number(link.dataset.time))); });
  }
  const colour = document.getElementById("colour");
  colour.addEventListener("change", () => {
    const names = figures.scene.data.map((trace) => trace.name);
    const kinds = Object.keys(machine.colours);
    const traces = kinds.map((kind) => names.indexOf(machine.colours[kind]));
    Plotly.restyle("scene", { visible: kinds.map((kind) => kind === colour.value) }, traces);
  });
})();
