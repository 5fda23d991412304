// Plots: rows that share their x axis, its zoom and its cursor.
import uPlot from "uplot";
import style from "uplot/dist/uPlot.min.css";
import { colour, element, short, swatch } from "./theme.js";

const FONT = "12px system-ui, sans-serif", ROW_PX = 118, FOOT_PX = 40, ON_PAPER_PX = 76;

export class Plots {
  /** holder; data: the page's `plots`; arrays; onPick(x) is told of a click. */
  constructor(holder, data, arrays, onPick) {
    document.head.append(element("style", { textContent: style }));
    this.holder = holder;
    this.data = data;
    this.x = arrays.column(data.x);
    this.mark_ = this.x[0];
    const last = data.rows.length - 1;
    this.rows = data.rows.map((row, k) => this._row(row, arrays.columns(row.array), k === last, onPick));
    new ResizeObserver(() => this.resize()).observe(holder);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
  }

  _row(row, columns, isLast, onPick) {
    const told = element("output"), names = element("span", { className: "chips" });
    if (!row.grouped) row.series.forEach((s) => names.append(element("span", {}, swatch(s.colour), s.name)));
    const figure = element("figure", {}, element("figcaption", {}, element("b", { textContent: row.title }), names, told));
    this.holder.append(figure);
    const axis = { stroke: () => colour("--quiet"), grid: { stroke: () => colour("--line"), width: 1 }, ticks: { show: false }, font: FONT, labelFont: FONT };
    const plot = new uPlot({
      width: Math.max(this.holder.clientWidth, 200), height: ROW_PX + (isLast ? FOOT_PX : 0), legend: { show: false }, padding: [8, 8, null, 0],
      cursor: { sync: { key: "page", setSeries: false }, drag: { x: true, y: false, uni: 8 }, points: { show: false }, y: false },
      scales: { x: { time: false, range: (u, low, high) => [low, high] }, y: { range: (u, low, high) => rangeOf(row, low, high) } },
      axes: [
        isLast
          ? { ...axis, size: 38, label: this.data.label, labelSize: 16, gap: 2 }
          : { ...axis, size: 6, values: (u, splits) => splits.map(() => "") },
        { ...axis, size: 64, gap: 4, values: (u, splits) => splits.map(short) },
      ],
      series: [{}, ...row.series.map((s) => seriesOf(s))],
      hooks: {
        draw: [(u) => limitLines(u, row.limits)],
        setCursor: [(u) => { told.textContent = this._told(u, row, columns); }],
        setScale: [(u, key) => key === "x" && this._follow(u)],
      },
    }, [this.x, ...columns.map(withGaps)], figure);
    plot.now = plot.over.appendChild(element("div", { className: "now" }));
    plot.grouped = row.grouped;
    let from = 0;
    plot.over.addEventListener("mousedown", (event) => { from = event.clientX; });
    plot.over.addEventListener("click", (event) => { if (onPick && Math.abs(event.clientX - from) < 4) onPick(plot.posToVal(plot.cursor.left, "x")); });
    return plot;
  }

  _told(u, row, columns) {
    const at = u.cursor.idx;
    if (at == null) return "";
    const values = row.series.map((s, k) => (u.series[k + 1].show ? `${s.name} ${short(columns[k][at])}` : "")).filter(Boolean);
    return `${short(this.x[at])}${this.data.unit}: ${values.join(", ")}`;
  }

  /** All rows show what one was zoomed to. */
  _follow(u) {
    const { min, max } = u.scales.x;
    for (const other of this.rows ?? []) if (other.scales.x.min !== min || other.scales.x.max !== max) other.setScale("x", { min, max });
    this.mark(this.mark_);
  }

  all() { this.rows[0].setScale("x", { min: this.x[0], max: this.x[this.x.length - 1] }); }

  /** Show where the machine is. */
  mark(x) {
    this.mark_ = x;
    if (this.isWithoutMark) return;
    for (const plot of this.rows ?? []) {
      const left = plot.valToPos(x, "x");
      plot.now.style.transform = `translateX(${left}px)`;
      plot.now.hidden = !(left >= 0 && left <= plot.over.clientWidth);
    }
  }

  /** Show or hide a series of the rows that are grouped: a leg. */
  showGroup(number, isShown) { for (const plot of this.rows) if (plot.grouped) plot.setSeries(number + 1, { show: isShown }); }

  resize(width = this.holder.clientWidth, height = ROW_PX) {
    if (width < 100) return;
    this.rows.forEach((plot, k) => {
      const size = { width, height: height + (k === this.rows.length - 1 ? FOOT_PX : 0) };
      if (plot.width !== size.width || plot.height !== size.height) plot.setSize(size);
    });
    this.mark(this.mark_);
  }

  /** Be as wide as paper, and lower. */
  toPaper(width) { this.resize(width, ON_PAPER_PX); }

  redraw() { for (const plot of this.rows) plot.redraw(); }
}

/** uPlot leaves a gap where there is null. */
const withGaps = (column) => (column.some(Number.isNaN) ? Array.from(column, (v) => (Number.isNaN(v) ? null : v)) : column);

function seriesOf({ name, colour: ink, dash, style: kind }) {
  const base = { label: name, stroke: ink, points: { show: false }, pxAlign: 0 }; // whole pixels would make stairs of slow curves
  if (kind === "points") return { ...base, paths: () => null, points: { show: true, size: 6, fill: ink, stroke: ink } };
  if (kind === "bars") return { ...base, fill: ink, paths: uPlot.paths.bars({ size: [0.6, 12] }) };
  return { ...base, width: 1.25, dash };
}

function rangeOf(row, low, high) {
  const known = [low, high].filter((v) => v != null), a = Math.min(...known, ...row.limits), b = Math.max(...known, ...row.limits);
  if (!Number.isFinite(a)) return [0, 1];
  const room = 0.06 * (b - a || Math.abs(a) || 1);
  return [row.low ?? a - room, b + room];
}

function limitLines(u, limits) {
  const pen = u.ctx, { left, top, width, height } = u.bbox;
  pen.save();
  pen.strokeStyle = colour("--bad");
  pen.lineWidth = 1.2 * devicePixelRatio;
  pen.setLineDash([6 * devicePixelRatio, 4 * devicePixelRatio]);
  for (const value of limits) {
    const y = u.valToPos(value, "y", true);
    if (y < top - 1 || y > top + height + 1) continue;
    pen.beginPath();
    pen.moveTo(left, y);
    pen.lineTo(left + width, y);
    pen.stroke();
  }
  pen.restore();
}
