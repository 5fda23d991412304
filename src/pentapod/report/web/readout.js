// What the page tells of a moment, and the legend of the path's colours.
import { digits, element, ramp, rgb, short, swatch } from "./theme.js";

/** Red, green, blue of each key, by a scale of the page. */
export function scaleOf(scale, data, motion) {
  const out = new Float32Array(3 * motion.count);
  if (scale.array === "key.cause") {
    const kinds = data.kinds.map(({ colour }) => rgb(colour));
    motion.causes.forEach((cause, k) => out.set(kinds[data.causes[cause].kind], 3 * k));
    return out;
  }
  const colours = ramp(data.ramp), { worst, best } = scale;
  motion.values[scale.array].forEach((value, k) => out.set(colours((value - worst) / (best - worst)), 3 * k));
  return out;
}

/** Elements of the legend. */
export function legend(scale, data) {
  if (scale.array === "key.cause") {
    return data.kinds.filter(({ seconds }) => seconds > 0).map(({ name, colour, told }) => element("span", {}, swatch(colour), `${name} `, element("b", { textContent: told })));
  }
  const bar = element("span", { className: "ramp" });
  bar.style.background = `linear-gradient(90deg, ${data.ramp.map(([at, hex]) => `${hex} ${100 * at}%`).join(", ")})`;
  return [bar, element("span", { className: "ends" }, ...scale.ends.map((text) => element("span", { textContent: text })))];
}

/** The list of what is so at a moment. */
export class Told {
  constructor(list, data, motion) {
    this.data = data;
    this.motion = motion;
    const names = ["segment", "tip, mm", "limited by", ...data.scales.filter(({ array }) => array !== "key.cause").map(({ name }) => name), "legs, mm"];
    this.values = names.map((name) => {
      const value = element("dd");
      list.append(element("div", {}, element("dt", { textContent: name }), value));
      return value;
    });
  }

  /** Show a state of `Motion.at` with the lengths of the legs; returns a sentence. */
  show({ key, tip }, legs) {
    const { data, motion } = this, kind = data.kind_names[motion.kinds[key]], segment = `${motion.segments[key]}, ${kind}`;
    const values = data.scales.filter(({ array }) => array !== "key.cause").map(({ array, unit }) => {
      const value = `${short(motion.values[array][key])}${unit}`;
      return array === "key.margin" ? `${value}, ${data.margins[motion.nearest[key]]}` : value;
    });
    const place = tip.map((v) => digits(v)).join(", "), cause = data.causes[motion.causes[key]].name;
    const texts = [segment, place, cause, ...values, legs ? legs.map((v) => digits(v)).join("  ") : "–"];
    texts.forEach((text, k) => { this.values[k].textContent = text; });
    return `${motion.times[key].toFixed(1)} seconds, segment ${segment}, limited by ${cause}`;
  }
}
