// The study that the page belongs to: the fitness of its generations, how far it is, and which controller drives.

import { BOTTOM, LEFT, drawValues, round } from "./charts.js";
import { age, fit, inks, make, number, say } from "./dom.js";
import { hub } from "./hub.js";
import { HUES, line } from "./robotshape.js";

/** @import { App } from "./app.js" */
/** @import { Point } from "./robotshape.js" */

/** @typedef {ReturnType<Part["scale"]>} Scale */

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
const MOST = 2000; // points of a curve: no screen shows more
const RIGHT = 12,
  TOP = 22; // pixels beside and above the curves
const BEST = 0,
  UPPER = 1,
  MEAN = 2,
  LOWER = 3,
  LOWEST = 4; // where each is in a generation
const BAND = 0.22; // opacity
const COMPILING = "The code is compiled first. The first time, this takes a minute or more.";

export class Part {
  /** @param {HTMLElement} box @param {App} app @param {About} about */
  constructor(box, app, about) {
    this.about = about;
    /** @type {Generation[]} */
    this.generations = [];
    /** @type {number | null} */
    this.cursor = null; // pixels from the left, where the mouse points
    this.text = make("p", { className: "how-far" });
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
    this.list = make("select", {}, new Option("Always the best so far", ""));
    this.list.onchange = () =>
      app.ask("choose_controller", { number: this.list.value ? Number(this.list.value) : null });
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
        { open: innerWidth > 900 }, // on a phone, the world is more important
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
    const left = done ? `${age(news.left)} left` : "the first one is being tried out …";
    say(this.text, news.outcome || `${done} of ${count} generations · ${left}`);
    say(
      this.best,
      best ? `Best${news.outcome ? "" : " so far"}: ${number(best[1], 3)}, of generation ${best[0]}` : COMPILING,
    );
    this.bar.value = done;
    for (const [k, [generation, fitness]] of news.bests.entries())
      if (k > this.list.length - 2)
        this.list.add(new Option(`Generation ${generation}: ${number(fitness, 3)}`, String(k)), 1);
    this.list.value = String(news.chosen ?? "");
    const drives = `The best of generation ${news.shown} drives, ${seconds} s in each world.`;
    say(this.shown, news.shown ? drives : "");
    this.canvas.setAttribute("aria-label", `fitness of ${done} generations; the newest values stand below`);
    this.paint();
  }

  paint() {
    const { pen, width, height } = fit(this.canvas),
      ink = inks("grid", "faint"),
      hues = HUES[document.documentElement.dataset.theme ?? "light"],
      scale = this.scale(width, height);
    pen.font = "11px system-ui, sans-serif";
    pen.fillStyle = ink.faint;
    pen.strokeStyle = ink.grid;
    pen.beginPath();
    drawValues(pen, scale.low, scale.high, width, scale.y);
    this.drawNumbers(pen, scale, width, height);
    pen.stroke();
    this.drawCurves(pen, scale, hues);
    const at = this.pointed(scale.x);
    if (at && this.cursor !== null) {
      pen.strokeStyle = ink.faint;
      pen.lineWidth = 1;
      line(pen, [scale.x(at), TOP], [scale.x(at), height - BOTTOM]);
      pen.stroke();
    }
    this.sayValues(at, hues);
  }

  /**
   * Where generations, from 1, and values are on the canvas; from the lowest to the highest value.
   * @param {number} width
   * @param {number} height
   */
  scale(width, height) {
    const all = this.generations.flatMap((each) => each.slice(BEST, LOWEST)),
      lowest = all.reduce((a, b) => Math.min(a, b), Infinity),
      highest = all.reduce((a, b) => Math.max(a, b), -Infinity),
      room = 0.06 * (highest - lowest) || 0.5;
    const [low, high] = all.length ? [lowest - room, highest + room] : [0, 1],
      last = Math.max(Math.min(LEAST, this.about.count), this.generations.length, 2);
    return {
      ...{ low, high, last },
      x: (/** @type {number} */ generation) => LEFT + ((generation - 1) / (last - 1)) * (width - LEFT - RIGHT),
      y: (/** @type {number} */ value) => TOP + ((high - value) / (high - low)) * (height - TOP - BOTTOM),
    };
  }

  /**
   * Draw a line for each round generation, with its number, and what the axes are.
   * @param {CanvasRenderingContext2D} pen
   * @param {Scale} scale
   * @param {number} width
   * @param {number} height
   */
  drawNumbers(pen, { x, last }, width, height) {
    pen.textAlign = "center";
    pen.textBaseline = "alphabetic";
    for (const generation of round(1, last).values.filter(Number.isInteger)) {
      pen.moveTo(x(generation), TOP);
      pen.lineTo(x(generation), height - BOTTOM);
      pen.fillText(String(generation), x(generation), height - 5);
    }
    pen.textAlign = "left";
    pen.fillText("fitness", 2, 10);
    pen.textAlign = "right";
    pen.fillText("generation", width, height - BOTTOM - 4);
  }

  /**
   * The generation that the mouse points at, or else the last one; 0 before the first.
   * @param {(generation: number) => number} x
   */
  pointed(x) {
    const count = this.generations.length;
    if (this.cursor === null) return count;
    const share = (this.cursor - x(1)) / (x(2) - x(1));
    return Math.min(count, 1 + Math.round(Math.max(0, share)));
  }

  /** @param {number} generation @param {string[]} hues */
  sayValues(generation, hues) {
    say(this.which, generation ? `Generation ${generation}` : "");
    const told = this.generations[generation - 1]?.map((value) => number(value, 3));
    const texts = told ? [told[BEST], told[MEAN], `${told[LOWER]} to ${told[UPPER]}`, told[LOWEST]] : [];
    const pale = `color-mix(in srgb, ${hues[1]} ${100 * BAND}%, transparent)`;
    this.keys.forEach(({ value, box }, k) => {
      say(value, texts[k] ?? "");
      box.style.setProperty("--hue", [hues[0], hues[1], pale, "transparent"][k]);
    });
  }

  /**
   * Draw the band of the middle half, and a line for best and mean.
   * @param {CanvasRenderingContext2D} pen
   * @param {Scale} scale
   * @param {string[]} hues
   */
  drawCurves(pen, { x, y }, hues) {
    const { generations } = this,
      every = Math.ceil(generations.length / MOST);
    /** @type {(which: number) => Point[]} */
    const points = (which) =>
      generations.map((each, k) => /** @type {Point} */ ([x(k + 1), y(each[which])])).filter((_, k) => k % every === 0);
    line(pen, ...points(UPPER), ...points(LOWER).reverse());
    pen.fillStyle = hues[1];
    pen.globalAlpha = BAND;
    pen.fill();
    pen.globalAlpha = 1;
    pen.lineWidth = 1.8;
    pen.lineJoin = "round";
    [BEST, MEAN].forEach((which, k) => {
      line(pen, ...points(which));
      pen.strokeStyle = hues[k];
      pen.stroke();
    });
  }
}
