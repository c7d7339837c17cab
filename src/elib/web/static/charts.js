// A strip chart of any reading: paused, zoomed in time, each value switched on and off by its name.

import { fit, inks, make, number, say, store } from "./dom.js";

/** @import { Instrument, Known, Point, Scheme } from "./hub.js" */

/** @typedef {Omit<Instrument, "absent">} Choice what a chart can show */
/** @typedef {(value: number) => number} Scale from seconds or values to pixels */

/**
 * Where the curves are drawn.
 * @typedef {{ low: number, high: number, last: number, x: Scale, y: Scale }} Axes `last` is the newest time, s
 * @typedef {Axes & { left: number, width: number, height: number }} Places in pixels
 */

/** @type {Record<string, string[]>} */
const HUES = {
  light: ["#185a9d", "#c75116", "#2e7d50", "#8e448f", "#b02a48", "#606014", "#0e7490", "#5b5bd6"],
  dark: ["#6fb1f0", "#f2965a", "#7fd6a2", "#d59ad6", "#f08aa4", "#cfcf6a", "#5cc8dc", "#a5a5ff"],
};
/** @type {Record<string, number>} */
const LEAST = { counts: 20, "rev/s": 0.1, g: 0.1, s: 0.005 }; // from the lowest to the highest value, by unit
const SPANS = [5, 10, 20, 60, 120, 300]; // s
const NO_RANGE = { physical_unit: "", low: null, high: null };
/** @type {Choice} */
const LINK = { name: "~latency", title: "Round trip", labels: ["median"], units: ["s"], ...NO_RANGE };
/** @type {Choice} */
const WHEELS = {
  name: "~wheels",
  title: "Wheels, as commanded",
  labels: ["left", "right"],
  units: ["rev/s", "rev/s"],
  ...NO_RANGE,
};

class Chart {
  /** @param {HTMLElement} box @param {string} name of the instrument @param {() => void} remove */
  constructor(box, name, remove) {
    this.span = 20;
    /** @type {Point[] | null} */
    this.pausedAt = null;
    /** @type {Set<number>} */
    this.hidden = new Set();
    this.wanted = name;
    /** @type {Known | null} */
    this.robot = null;
    /** @type {number | null} */
    this.number = null; // of the scheme that the list is made of
    /** @type {Choice[]} */
    this.choices = [];
    /** @type {Choice | null} */
    this.what = null; // what is shown
    /** @type {HTMLElement[]} */
    this.now = []; // the newest values, under the chart
    box.classList.add("chart");
    this.list = make("select", {
      "aria-label": "what the chart shows",
      onchange: () => {
        this.wanted = this.list.value;
        this.hidden.clear();
        this.dress();
      },
    });
    this.pause = make("button", {
      type: "button",
      className: "plain",
      textContent: "Pause",
      "aria-pressed": "false",
      onclick: () => this.hold(),
    });
    /** @type {(text: string, by: number, name: string) => HTMLButtonElement} */
    const zoom = (text, by, name) =>
      make("button", {
        type: "button",
        className: "plain",
        textContent: text,
        "aria-label": name,
        onclick: () => this.zoom(by),
      });
    this.spanText = make("output", { textContent: "20 s" });
    this.isFitted = make("input", { type: "checkbox", onchange: () => this.paint() });
    /** @type {number | null} */
    this.cursor = null; // pixels from the left, where the mouse points
    /** @type {[low: number, high: number] | null} */
    this.grown = null; // of a reading without a range of its own
    this.canvas = make("canvas", { role: "img" });
    this.canvas.addEventListener("pointermove", (event) => {
      this.cursor = event.offsetX;
      this.paint();
    });
    this.canvas.addEventListener("pointerleave", () => {
      this.cursor = null;
      this.paint();
    });
    this.canvas.addEventListener(
      "wheel",
      (event) => {
        if (!event.ctrlKey) return;
        event.preventDefault();
        this.zoom(Math.sign(event.deltaY));
      },
      { passive: false },
    );
    this.legend = make("div", { className: "legend" });
    const removing = make("button", {
      type: "button",
      className: "plain",
      textContent: "×",
      "aria-label": "remove this chart",
      onclick: remove,
    });
    box.append(
      make(
        "div",
        { className: "row wrap" },
        this.list,
        this.pause,
        zoom("−", 1, "show a longer time"),
        this.spanText,
        zoom("+", -1, "show a shorter time"),
        make("label", { className: "check", title: "Enlarge what is shown to the whole height" }, this.isFitted, "fit"),
        make("button", { type: "button", className: "plain", textContent: "CSV", onclick: () => this.saveTable() }),
        make("button", { type: "button", className: "plain", textContent: "PNG", onclick: () => this.savePicture() }),
        removing,
      ),
      this.canvas,
      this.legend,
    );
  }

  hold() {
    if (!this.robot) return;
    this.pausedAt = this.pausedAt === null ? this.robot.history.slice() : null;
    say(this.pause, this.pausedAt ? "Continue" : "Pause");
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
    if (robot.scheme && robot.scheme.scheme !== this.number) this.fill(robot.scheme);
    if (this.pausedAt === null && this.canvas.offsetParent) this.paint();
  }

  /** @param {Scheme} scheme */
  fill(scheme) {
    this.number = scheme.scheme;
    this.choices = [
      ...scheme.instruments
        .filter((each) => !each.absent)
        .map((each) => (each.physical_unit ? { ...each, units: each.labels.map(() => each.physical_unit) } : each)),
      WHEELS,
      LINK,
    ];
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
          checked: !this.hidden.has(k),
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
    return (HUES[document.documentElement.dataset.theme ?? ""] ?? HUES.light)[k % 8];
  }

  /** @param {Point} point @returns {(number | null)[] | undefined} */
  values(point) {
    if (this.wanted === LINK.name) return [point.latency];
    return this.wanted === WHEELS.name ? point.wheels : point.values[this.wanted];
  }

  paint() {
    const { what } = this;
    if (!this.robot || !what) return;
    const history = this.pausedAt ?? this.robot.history,
      { pen, width, height } = fit(this.canvas),
      ink = inks("grid", "faint");
    const last = history.length ? history[history.length - 1].time : 0,
      from = last - this.span;
    let start = history.length;
    while (start > 0 && history[start - 1].time >= from) start--;
    const points = history.slice(Math.max(0, start - 1)),
      shown = what.labels.map((_, k) => k).filter((k) => !this.hidden.has(k));
    const [low, high] = this.range(what, points, shown);
    const left = 52,
      bottom = 20;
    /** @type {Scale} */
    const x = (time) => left + ((time - from) / this.span) * (width - left - 6);
    /** @type {Scale} */
    const y = (value) => 6 + ((high - value) / (high - low)) * (height - bottom - 8);
    this.scales(pen, ink, { left, low, high, x, y, last, width, height });
    pen.save();
    pen.beginPath();
    pen.rect(left, 0, width - left, height);
    pen.clip();
    pen.lineWidth = 1.8;
    pen.lineJoin = "round";
    for (const k of shown) {
      pen.strokeStyle = this.hue(k);
      pen.beginPath();
      let isDown = false,
        before = 0;
      for (const point of points) {
        const value = this.values(point)?.[k];
        if (value === undefined || value === null) {
          isDown = false;
          continue;
        } // a gap is a gap
        if (isDown && point.time - before < 1) pen.lineTo(x(point.time), y(+value));
        else pen.moveTo(x(point.time), y(+value));
        [isDown, before] = [true, point.time];
      }
      pen.stroke();
    }
    pen.restore();
    const told = this.drawCursor(pen, ink.faint, points, x, left, height) ?? history.at(-1);
    const newest = told ? this.values(told) : null;
    this.now.forEach((text, k) =>
      say(text, `${number(newest?.[k] ?? null, Number.isInteger(newest?.[k]) ? 0 : 2)} ${what.units[k] ?? ""}`),
    );
  }

  /**
   * The lowest and the highest value of the scale: the instrument's own, unless a person wants what is shown enlarged.
   * @param {Choice} what
   * @param {Point[]} points
   * @param {number[]} shown
   * @returns {[low: number, high: number]}
   */
  range(what, points, shown) {
    const isFixed = !this.isFitted.checked;
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
   * Draw a line where the mouse points; returns the moment there.
   * @param {CanvasRenderingContext2D} pen
   * @param {string} ink
   * @param {Point[]} points
   * @param {Scale} x
   * @param {number} left
   * @param {number} height
   */
  drawCursor(pen, ink, points, x, left, height) {
    if (this.cursor === null || this.cursor < left || !points.length) return null;
    const at = this.cursor;
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
    const { what, robot } = this;
    if (!what || !robot) return;
    const history = this.pausedAt ?? robot.history,
      from = (history.at(-1)?.time ?? 0) - this.span;
    const head = ["seconds", ...what.labels.map((label, k) => `${label} ${what.units[k] ?? ""}`.trim())];
    const rows = history
      .filter((point) => point.time >= from && this.values(point))
      .map((point) => [point.time.toFixed(3), ...(this.values(point) ?? []).map((value) => value ?? "")]);
    const text = [head, ...rows].map((row) => row.join(",")).join("\n");
    store(new Blob([`${text}\n`], { type: "text/csv" }), `${this.wanted}.csv`);
  }

  /** Save the chart as it is seen. */
  savePicture() {
    this.canvas.toBlob((blob) => blob && store(blob, `${this.wanted}.png`));
  }

  /**
   * Draw the lines behind the curves, and their numbers.
   * @param {CanvasRenderingContext2D} pen
   * @param {Record<string, string>} ink
   * @param {Places} places
   */
  scales(pen, ink, { left, low, high, x, y, last, width, height }) {
    const span = high - low,
      power = 10 ** Math.floor(Math.log10(span / 4)),
      step = [1, 2, 5, 10].map((each) => each * power).find((each) => span / each <= 5) ?? span;
    pen.font = "11px system-ui, sans-serif";
    pen.fillStyle = ink.faint;
    pen.strokeStyle = ink.grid;
    pen.lineWidth = 1;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    pen.beginPath();
    for (let value = Math.ceil(low / step) * step; value <= high; value += step) {
      pen.moveTo(left, y(value));
      pen.lineTo(width, y(value));
      pen.fillText(number(value, Math.max(0, -Math.floor(Math.log10(step)))), left - 6, y(value));
    }
    pen.textAlign = "center";
    pen.textBaseline = "alphabetic";
    const beat = this.span / 5;
    for (let k = 0; k <= 5; k++) {
      const at = x(last - k * beat);
      pen.moveTo(at, 0);
      pen.lineTo(at, height - 18);
      if (k < 5) pen.fillText(k ? `−${Math.round(k * beat)} s` : "now", Math.min(at, width - 14), height - 5);
    }
    pen.stroke();
  }
}

const FIRST = ["proximity", "speed"],
  MOST = 6;

export class Part {
  /** @param {HTMLElement} box */
  constructor(box) {
    /** @type {Set<Chart>} */
    this.charts = new Set();
    this.place = make("div", { className: "charts" });
    box.append(
      this.place,
      make("button", {
        type: "button",
        className: "plain",
        textContent: "Add a chart",
        onclick: () => this.add("accelerometer"),
      }),
    );
    for (const name of FIRST) this.add(name);
  }

  /** @param {string} name */
  add(name) {
    if (this.charts.size >= MOST) return;
    const box = make("div");
    const chart = new Chart(box, name, () => {
      box.remove();
      this.charts.delete(chart);
    });
    this.charts.add(chart);
    this.place.append(box);
  }

  /** @param {Known} robot */
  show(robot) {
    for (const chart of this.charts) chart.show(robot);
  }
}
