// The study that the page belongs to: the fitness of its generations, how far it is, and which controller drives.

import { BOTTOM, LEFT, drawValues, round } from "./charts.js";
import { age, fit, inks, make, number, say } from "./dom.js";
import { hub } from "./hub.js";
import { HUES } from "./robotshape.js";

/** @import { App } from "./app.js" */

/**
 * @typedef {[best: number, upper: number, mean: number, lower: number, lowest: number]} Generation fitness
 * @typedef {{
 *   task: string, summary: string, count: number, seconds: number, settings: Record<string, string>,
 * }} About what does not change; elib/learn/studypage.py writes it
 * @typedef {{
 *   first: number, generations: Generation[], bests: [generation: number, fitness: number][], left: number,
 *   outcome: string, chosen: number | null, shown: number | null,
 * }} News the generations from the first on that the page does not know yet, and how far the study is
 */

const LEAST = 10; // generations that the axis has room for
const RIGHT = 12,
  TOP = 22; // pixels beside and above the curves
const BEST = 0,
  UPPER = 1,
  MEAN = 2,
  LOWER = 3,
  LOWEST = 4; // where each is in a generation
const BAND = 0.22; // opacity

export class Part {
  /** @param {HTMLElement} box @param {App} app @param {About} about */
  constructor(box, app, about) {
    this.about = about;
    /** @type {Generation[]} */
    this.generations = [];
    /** @type {string | null} */
    this.listed = null;
    /** @type {number | null} */
    this.cursor = null; // pixels from the left, where the mouse points
    this.text = make("p", { className: "how-far", role: "status" });
    this.best = make("p");
    this.bar = make("progress", { max: about.count, value: 0, "aria-label": "generations done" });
    this.canvas = make("canvas", { role: "img" });
    for (const name of /** @type {const} */ (["pointermove", "pointerdown", "pointerleave"]))
      this.canvas.addEventListener(name, (event) => {
        this.cursor = name === "pointerleave" ? null : event.offsetX;
        this.paint();
      });
    this.which = make("b");
    this.keys = ["best", "mean", "middle half", "lowest"].map((name) => {
      const value = make("b");
      return { value, box: make("span", { className: "check" }, name, value) };
    });
    this.list = make("select", {
      onchange: () => app.ask("choose_controller", { number: this.list.value ? Number(this.list.value) : null }),
    });
    this.shown = make("p", { className: "hint" });
    box.append(
      make("h2", { textContent: `Study: ${about.task}` }),
      make("p", { textContent: about.summary }),
      this.text,
      this.bar,
      this.best,
      this.canvas,
      make("div", { className: "legend" }, this.which, ...this.keys.map(({ box }) => box)),
      make("label", { className: "field" }, "Who drives", this.list),
      this.shown,
      make(
        "details",
        { open: true },
        make("summary", { textContent: "Settings" }),
        make(
          "dl",
          {},
          ...Object.entries(about.settings).flatMap(([name, value]) => [
            make("dt", { textContent: name }),
            make("dd", { textContent: value }),
          ]),
        ),
      ),
    );
    this.watch = new ResizeObserver(() => this.paint());
    this.watch.observe(this.canvas);
    this.theme = new MutationObserver(() => this.paint());
    this.theme.observe(document.documentElement, { attributeFilter: ["data-theme"] });
    this.unlisten = hub.listen("study", (news) => this.take(news));
  }

  close() {
    this.unlisten();
    this.watch.disconnect();
    this.theme.disconnect();
  }

  /** @param {News} news */
  take(news) {
    if (news.first > this.generations.length) return; // of an earlier connection
    this.generations = this.generations.slice(0, news.first).concat(news.generations);
    const done = this.generations.length,
      best = news.bests.at(-1),
      { count, seconds } = this.about;
    const state = news.outcome || (done ? `${age(news.left)} left` : "the first one is being tried out …");
    say(this.text, `${done} of ${count} generations · ${state}`);
    say(this.best, best ? `Best so far: ${number(best[1], 3)}, in generation ${best[0]}` : "");
    this.bar.value = done;
    this.offer(news);
    this.list.value = String(news.chosen ?? "");
    const drives = `The best of generation ${news.shown} drives, ${seconds} s in each world.`;
    say(this.shown, news.shown ? drives : "");
    this.canvas.setAttribute("aria-label", `fitness of ${done} generations; the newest values stand below`);
    this.paint();
  }

  /** @param {News} news */
  offer({ bests }) {
    if (this.listed === String(bests)) return;
    this.listed = String(bests);
    const own = bests.map(([generation, fitness], k) => {
      return new Option(`Generation ${generation}: ${number(fitness, 3)}`, String(k));
    });
    this.list.replaceChildren(new Option("Always the best so far", ""), ...own.reverse());
  }

  paint() {
    const { generations } = this,
      { pen, width, height } = fit(this.canvas),
      ink = inks("grid", "faint"),
      hues = HUES[document.documentElement.dataset.theme ?? "light"];
    const all = generations.flatMap((each) => each.slice(BEST, LOWEST)),
      low = all.reduce((a, b) => Math.min(a, b), Infinity),
      high = all.reduce((a, b) => Math.max(a, b), -Infinity),
      room = 0.06 * (high - low) || 0.5;
    const [bottom, top] = all.length ? [low - room, high + room] : [0, 1],
      last = Math.max(Math.min(LEAST, this.about.count), generations.length, 2);
    const x = (/** @type {number} */ k) => LEFT + ((k - 1) / (last - 1)) * (width - LEFT - RIGHT);
    const y = (/** @type {number} */ value) => TOP + ((top - value) / (top - bottom)) * (height - TOP - BOTTOM);
    pen.font = "11px system-ui, sans-serif";
    pen.fillStyle = ink.faint;
    pen.strokeStyle = ink.grid;
    pen.beginPath();
    drawValues(pen, bottom, top, width, y);
    pen.textAlign = "center";
    pen.textBaseline = "alphabetic";
    for (const k of round(1, last).values.filter(Number.isInteger)) {
      pen.moveTo(x(k), TOP);
      pen.lineTo(x(k), height - BOTTOM);
      pen.fillText(String(k), x(k), height - 5);
    }
    pen.stroke();
    pen.textAlign = "left";
    pen.fillText("fitness", 2, 10);
    pen.textAlign = "right";
    pen.fillText("generation", width, height - BOTTOM - 4);
    this.drawCurves(pen, hues, x, y);
    const at = this.pointed(x);
    if (at !== null && this.cursor !== null) {
      pen.strokeStyle = ink.faint;
      pen.lineWidth = 1;
      pen.beginPath();
      pen.moveTo(x(at + 1), TOP);
      pen.lineTo(x(at + 1), height - BOTTOM);
      pen.stroke();
    }
    say(this.which, at === null ? "" : `Generation ${at + 1}`);
    const told = at === null ? null : generations[at].map((value) => number(value, 3));
    const texts = told ? [told[BEST], told[MEAN], `${told[LOWER]} to ${told[UPPER]}`, told[LOWEST]] : [];
    this.keys.forEach(({ value, box }, k) => {
      say(value, texts[k] ?? "");
      box.style.setProperty(
        "--hue",
        [hues[0], hues[1], `color-mix(in srgb, ${hues[1]} ${100 * BAND}%, transparent)`, "transparent"][k],
      );
    });
  }

  /**
   * The generation that the mouse points at, or else the last one; null before the first.
   * @param {(k: number) => number} x
   */
  pointed(x) {
    const count = this.generations.length;
    if (!count) return null;
    const share = this.cursor === null ? 1 : (this.cursor - x(1)) / (x(count) - x(1) || 1);
    return Math.round(Math.max(0, Math.min(1, share)) * (count - 1));
  }

  /**
   * Draw the band of the middle half, and a line for best and mean.
   * @param {CanvasRenderingContext2D} pen
   * @param {string[]} hues
   * @param {(k: number) => number} x
   * @param {(value: number) => number} y
   */
  drawCurves(pen, hues, x, y) {
    const { generations } = this;
    /** @param {number} which */
    const points = (which) => generations.map((each, k) => /** @type {const} */ ([x(k + 1), y(each[which])]));
    pen.fillStyle = hues[1];
    pen.globalAlpha = BAND;
    pen.beginPath();
    for (const point of [...points(UPPER), ...points(LOWER).reverse()]) pen.lineTo(...point);
    pen.fill();
    pen.globalAlpha = 1;
    pen.lineWidth = 1.8;
    pen.lineJoin = "round";
    [BEST, MEAN].forEach((curve, k) => {
      pen.strokeStyle = hues[k];
      pen.beginPath();
      for (const point of points(curve)) pen.lineTo(...point);
      pen.stroke();
    });
  }
}
