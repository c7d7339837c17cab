// A strip chart of any reading: paused, zoomed in time, each value switched on and off by its name.

import { button, fit, inks, make, number, say, store } from "./dom.js";
import { SENSOR_NAMES } from "./robot.js";
import { HUES } from "./robotshape.js";

/** @import { Instrument, Known, Point, Scheme } from "./hub.js" */

/** @typedef {Omit<Instrument, "absent">} Choice what a chart can show */
/** @typedef {(value: number) => number} Scale from seconds or values to pixels */

/** @type {Record<string, number>} */
const LEAST = { counts: 20, "rev/s": 0.1, g: 0.1, s: 0.005 }; // from the lowest to the highest value, by unit
const SPANS = [5, 10, 20, 60, 120, 300]; // s
export const LEFT = 52,
  BOTTOM = 20; // pixels for the numbers beside the curves
const NO_RANGE = { physical_unit: "", low: null, high: null };
/** @type {Choice[]} */
const OWN = [
  { name: "~wheels", title: "Wheels, as commanded", labels: ["left", "right"], units: ["rev/s", "rev/s"], ...NO_RANGE },
  { name: "~latency", title: "Round trip", labels: ["median"], units: ["s"], ...NO_RANGE },
];
const INFRARED = SENSOR_NAMES.map((name, sensor) => `IR${sensor} ${name}`);
const FIRST = ["proximity", "speed"],
  MOST = 6;

/**
 * Round values between two others, and how many digits after the point they need.
 * @param {number} low
 * @param {number} high
 */
export function round(low, high) {
  const span = high - low,
    power = 10 ** Math.floor(Math.log10(span / 4)),
    step = [1, 2, 5, 10].map((each) => each * power).find((each) => span / each <= 5) ?? span,
    first = Math.ceil(low / step);
  const values = Array.from({ length: Math.floor(high / step) - first + 1 }, (_, k) => (first + k) * step);
  return { values, digits: Math.max(0, -Math.floor(Math.log10(step))) };
}

/**
 * Draw a line for each round value, with its number.
 * @param {CanvasRenderingContext2D} pen
 * @param {number} low
 * @param {number} high
 * @param {number} width
 * @param {Scale} y
 */
export function drawValues(pen, low, high, width, y) {
  const { values, digits } = round(low, high);
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  for (const value of values) {
    pen.moveTo(LEFT, y(value));
    pen.lineTo(width, y(value));
    pen.fillText(number(value, digits), LEFT - 6, y(value));
  }
}

class Chart {
  /** @param {string} name of the instrument @param {(chart: Chart) => void} remove */
  constructor(name, remove) {
    this.span = 20;
    /** @type {Point[] | null} */
    this.pausedAt = null;
    /** @type {Set<number>} */
    this.hidden = new Set();
    this.wanted = name;
    /** @type {Known | null} */
    this.robot = null;
    /** @type {Scheme | null} */
    this.scheme = null; // that the list is made of
    /** @type {Choice[]} */
    this.choices = OWN;
    this.what = OWN[0]; // what is shown
    /** @type {HTMLElement[]} */
    this.now = []; // the newest values, under the chart
    /** @type {number | null} */
    this.cursor = null; // pixels from the left, where the mouse points
    /** @type {[low: number, high: number] | null} */
    this.grown = null; // of a reading without a range of its own
    this.list = make("select", {
      "aria-label": "what the chart shows",
      onchange: () => {
        this.wanted = this.list.value;
        this.hidden.clear();
        this.dress();
      },
    });
    this.pause = button("Pause chart", () => this.hold(), { "aria-pressed": "false" });
    this.spanText = make("output", { textContent: "20 s" });
    this.isFitted = make("input", { type: "checkbox", onchange: () => this.paint() });
    this.canvas = make("canvas", { role: "img" });
    for (const name of /** @type {const} */ (["pointermove", "pointerleave"]))
      this.canvas.addEventListener(name, (event) => {
        this.cursor = name === "pointermove" ? event.offsetX : null;
        this.paint();
      });
    this.canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      this.zoom(Math.sign(event.deltaY));
    });
    this.legend = make("div", { className: "legend" });
    this.box = make(
      "div",
      { className: "chart" },
      make(
        "div",
        { className: "row wrap" },
        this.list,
        this.pause,
        make(
          "div",
          { className: "row" },
          button("−", () => this.zoom(1), { "aria-label": "show a longer time" }),
          this.spanText,
          button("+", () => this.zoom(-1), { "aria-label": "show a shorter time" }),
        ),
        make(
          "label",
          { className: "check", title: "Stretch what is shown to the whole height" },
          this.isFitted,
          "Fit height",
        ),
        button("CSV", () => this.saveTable()),
        button("PNG", () => this.canvas.toBlob((blob) => blob && store(blob, `${this.wanted}.png`))),
        button("×", () => remove(this), { "aria-label": "remove this chart" }),
      ),
      this.canvas,
      this.legend,
    );
  }

  hold() {
    if (!this.robot) return;
    this.pausedAt = this.pausedAt ? null : this.robot.history.slice();
    say(this.pause, this.pausedAt ? "Continue chart" : "Pause chart");
    this.pause.setAttribute("aria-pressed", String(this.pausedAt !== null));
    this.paint();
  }

  /** @param {number} by */
  zoom(by) {
    this.span = SPANS[Math.max(0, Math.min(SPANS.length - 1, SPANS.indexOf(this.span) + by))];
    say(this.spanText, this.span < 60 ? `${this.span} s` : `${this.span / 60} min`);
    this.paint();
  }

  /** @param {Known} robot */
  show(robot) {
    this.robot = robot;
    if (robot.scheme && robot.scheme !== this.scheme) this.fill(robot.scheme);
    if (!this.pausedAt && this.canvas.offsetParent) this.paint();
  }

  /** @param {Scheme} scheme */
  fill(scheme) {
    this.scheme = scheme;
    this.choices = scheme.instruments
      .filter((each) => !each.absent)
      .map((each) => (each.physical_unit ? { ...each, units: each.labels.map(() => each.physical_unit) } : each))
      .map((each) => (each.name === "proximity" ? { ...each, labels: INFRARED } : each))
      .concat(/** @type {Instrument[]} */ (OWN));
    this.list.replaceChildren(...this.choices.map((each) => new Option(each.title, each.name)));
    if (!this.choices.some((each) => each.name === this.wanted)) this.wanted = this.choices[0].name;
    this.list.value = this.wanted;
    this.dress();
  }

  dress() {
    this.grown = null;
    const what = this.choices.find((each) => each.name === this.wanted) ?? this.choices[0];
    this.what = what;
    this.now = what.labels.map(() => make("b"));
    this.canvas.setAttribute("aria-label", `chart of ${what.title}; the newest values stand below it`);
    this.legend.replaceChildren(
      ...what.labels.map((label, k) => {
        const box = make("input", {
          type: "checkbox",
          checked: true,
          onchange: () => {
            this.hidden[box.checked ? "delete" : "add"](k);
            this.paint();
          },
        });
        return make("label", { className: "check", style: `--hue: ${this.hue(k)}` }, box, label, this.now[k]);
      }),
    );
    this.paint();
  }

  /** @param {number} k */
  hue(k) {
    return HUES[document.documentElement.dataset.theme ?? "light"][k % 8];
  }

  /** @param {Point} point @returns {(number | null)[] | undefined} */
  values(point) {
    if (this.wanted === "~latency") return [point.latency];
    return this.wanted === "~wheels" ? point.wheels : point.values[this.wanted];
  }

  /** The moments that are shown. */
  get points() {
    const history = this.pausedAt ?? this.robot?.history ?? [],
      from = (history.at(-1)?.time ?? 0) - this.span;
    return history.slice(
      Math.max(
        0,
        history.findIndex((point) => point.time >= from),
      ),
    );
  }

  paint() {
    if (!this.scheme) return;
    const { what, points } = this,
      { pen, width, height } = fit(this.canvas),
      ink = inks("grid", "faint");
    const last = points.at(-1)?.time ?? 0,
      shown = what.labels.map((_, k) => k).filter((k) => !this.hidden.has(k));
    const [low, high] = this.range(points, shown);
    /** @type {Scale} */
    const x = (time) => width - 6 - ((last - time) / this.span) * (width - LEFT - 6);
    /** @type {Scale} */
    const y = (value) => 6 + ((high - value) / (high - low)) * (height - BOTTOM - 8);
    pen.font = "11px system-ui, sans-serif";
    pen.fillStyle = ink.faint;
    pen.strokeStyle = ink.grid;
    pen.lineWidth = 1;
    pen.beginPath();
    drawValues(pen, low, high, width, y);
    this.drawTimes(pen, last, width, height, x);
    pen.stroke();
    pen.lineWidth = 1.8;
    pen.lineJoin = "round";
    for (const k of shown) {
      pen.strokeStyle = this.hue(k);
      pen.beginPath();
      let before = -Infinity;
      for (const point of points) {
        const value = this.values(point)?.[k] ?? null;
        if (value !== null) pen[point.time - before < 1 ? "lineTo" : "moveTo"](x(point.time), y(value));
        before = value === null ? -Infinity : point.time; // a gap is a gap
      }
      pen.stroke();
    }
    const told = this.drawCursor(pen, ink.faint, points, height, x) ?? points.at(-1),
      newest = told ? this.values(told) : null;
    this.now.forEach((text, k) => {
      const value = newest?.[k] ?? null;
      say(text, `${number(value, Number.isInteger(value) ? 0 : 2)} ${what.units[k] ?? ""}`);
    });
  }

  /**
   * The lowest and the highest value of the scale: the instrument's own, unless a person wants what is shown enlarged.
   * @param {Point[]} points
   * @param {number[]} shown
   * @returns {[low: number, high: number]}
   */
  range(points, shown) {
    const { what } = this,
      isFixed = !this.isFitted.checked;
    if (isFixed && !what.physical_unit && what.low !== null && what.high !== null) return [what.low, what.high];
    const values = points.flatMap((point) => shown.map((k) => this.values(point)?.[k] ?? NaN)).filter(Number.isFinite);
    if (isFixed && this.grown) values.push(...this.grown); // it grows, and never shrinks under the eyes
    const least = LEAST[what.units[0]] ?? 0.1,
      low = values.length ? Math.min(...values) : 0,
      high = values.length ? Math.max(...values) : least;
    if (isFixed) this.grown = [low, high];
    const room = Math.max(least - (high - low), 0.08 * (high - low)) / 2;
    return [low - room, high + room];
  }

  /**
   * Draw a line for each fifth of the time, with its seconds.
   * @param {CanvasRenderingContext2D} pen
   * @param {number} last
   * @param {number} width
   * @param {number} height
   * @param {Scale} x
   */
  drawTimes(pen, last, width, height, x) {
    pen.textAlign = "center";
    pen.textBaseline = "alphabetic";
    for (let k = 0; k <= 5; k++) {
      const ago = (k * this.span) / 5,
        at = x(last - ago);
      pen.moveTo(at, 0);
      pen.lineTo(at, height - 18);
      if (k < 5) pen.fillText(k ? `−${ago} s` : "now", Math.min(at, width - 14), height - 5);
    }
  }

  /**
   * Draw a line where the mouse points; return the moment there.
   * @param {CanvasRenderingContext2D} pen
   * @param {string} ink
   * @param {Point[]} points
   * @param {number} height
   * @param {Scale} x
   */
  drawCursor(pen, ink, points, height, x) {
    const at = this.cursor;
    if (at === null || at < LEFT || !points.length) return null;
    const near = points.reduce((best, point) =>
      Math.abs(x(point.time) - at) < Math.abs(x(best.time) - at) ? point : best,
    );
    pen.strokeStyle = ink;
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(x(near.time), 0);
    pen.lineTo(x(near.time), height - 18);
    pen.stroke();
    return near;
  }

  /** Save what is shown as a table: a line for each moment, seconds first. */
  saveTable() {
    const { labels, units } = this.what;
    const head = ["seconds", ...labels.map((label, k) => `${label} ${units[k] ?? ""}`.trim())];
    const rows = this.points.map((point) => [point.time.toFixed(3), ...(this.values(point) ?? labels.map(() => ""))]);
    const text = [head, ...rows].map((row) => row.join(",")).join("\n");
    store(new Blob([`${text}\n`], { type: "text/csv" }), `${this.wanted}.csv`);
  }
}

export class Part {
  /** @param {HTMLElement} box */
  constructor(box) {
    /** @type {Set<Chart>} */
    this.charts = new Set();
    this.place = make("div", { className: "charts" });
    box.append(
      this.place,
      button("Add a chart", () => this.add("accelerometer")),
    );
    for (const name of FIRST) this.add(name);
  }

  /** @param {string} name */
  add(name) {
    if (this.charts.size >= MOST) return;
    const chart = new Chart(name, () => {
      chart.box.remove();
      this.charts.delete(chart);
    });
    this.charts.add(chart);
    this.place.append(chart.box);
  }

  /** @param {Known} robot */
  show(robot) {
    for (const chart of this.charts) chart.show(robot);
  }
}
