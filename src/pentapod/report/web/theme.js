// Colours of the page's style, for what is drawn on a canvas, and the ramp from the worst to the best.

const PAPER = { "--ink": "#000000", "--quiet": "#444444", "--line": "#cccccc", "--bad": "#b3261e" };
let onPaper = false;

/** A colour of the style sheet; on paper one for white ground, also from a dark screen. */
export const colour = (name) =>
  (onPaper && PAPER[name]) || getComputedStyle(document.documentElement).getPropertyValue(name).trim();

export const setPaper = (isPaper) => { onPaper = isPaper; };

export const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255);

/** A function from 0, the worst, to 1, the best, to red, green and blue. stops: [share, hex], in order. */
export function ramp(stops) {
  const colours = stops.map(([at, hex]) => [at, ...rgb(hex)]);
  return (share) => {
    const s = Math.min(Math.max(share, 0), 1);
    let k = 1;
    while (k < colours.length - 1 && colours[k][0] < s) k++;
    const a = colours[k - 1], b = colours[k], part = Math.min(Math.max((s - a[0]) / (b[0] - a[0]), 0), 1);
    return [1, 2, 3].map((n) => a[n] + part * (b[n] - a[n]));
  };
}

/** A number for people: a true minus, and no more digits than are asked for. */
export const digits = (value, count = 2) => value.toFixed(count).replace("-", "−");
export const short = (value) =>
  value == null || Number.isNaN(value) ? "–"
    : (Math.abs(value) >= 1000 ? Math.round(value).toLocaleString("en") : String(Number(value.toPrecision(4)))).replace("-", "−");

/** An element with its text or its children. */
export function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

/** A square of a colour. */
export function swatch(ink) {
  const square = element("i");
  square.style.background = ink;
  return square;
}
