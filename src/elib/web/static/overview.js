// All robots at once: a card each, all from one message.

import { fit, inks, make, number, put, say } from "./dom.js";
import { drawRobot } from "./robotshape.js";
import { hub } from "./hub.js";
import { distance } from "./robot.js";

/** @import { Point } from "./robotshape.js" */
/** @import { Remote } from "./dom.js" */
/** @import { Channels, Summary } from "./hub.js" */

/** @type {(degrees: number) => number} */
const radians = (degrees) => (degrees * Math.PI) / 180;
/** @typedef {ReturnType<Part["card"]>} Card */

const DARK = new Uint8Array(24);

export class Part {
  /** @param {HTMLElement} box @param {{ sensors: number[], leds: number[] }} options in degrees @param {Emit} emit */
  constructor(box, options, emit) {
    this.box = box;
    this.emit = emit;
    /** @type {Map<string, Card>} */
    this.cards = new Map();
    this.sensors = options.sensors.map(radians);
    this.leds = options.leds.map(radians);
    box.classList.add("overview");
    this.none = make("p", { className: "hint", textContent: "No robot yet." });
    box.append(this.none);
    this.deaf = hub.listen("overview", (robots) => this.take(robots));
  }

  close() {
    this.deaf();
  }

  /** @param {Channels["overview"]} robots */
  take(robots) {
    const ink = inks("accent", "bad", "faint", "edge", "good", "grid");
    for (const [key, card] of this.cards)
      if (!(key in robots)) {
        card.box.remove();
        this.cards.delete(key);
      }
    for (const [key, robot] of Object.entries(robots)) {
      const card = this.cards.get(key) ?? this.card(key);
      if (!this.cards.has(key)) {
        this.cards.set(key, card);
        this.box.append(card.box);
      }
      this.fill(card, robot, ink);
    }
    this.none.hidden = this.cards.size > 0;
  }

  /** @param {string} key */
  card(key) {
    const canvas = make("canvas", { "aria-hidden": "true" }),
      chip = make("p", { className: "chip" }),
      facts = make("p", { className: "hint" }),
      name = make("button", { type: "button", className: "name", onclick: () => this.emit("open", { robot: key }) });
    const stop = make("button", {
      type: "button",
      className: "stop small",
      textContent: "Stop",
      onclick: () => this.emit("stop", { robot: key }),
    });
    const box = make("article", {}, canvas, make("div", {}, name, chip, facts), stop);
    return { box, canvas, chip, facts, name, stop };
  }

  /** @param {Card} card @param {Summary} robot @param {Record<string, string>} ink */
  fill(card, robot, ink) {
    say(card.name, robot.name);
    put(card.name, "title", robot.url);
    put(card.stop, "aria-label", `stop ${robot.name}`);
    card.chip.dataset.phase = robot.phase;
    say(card.chip, robot.phase_text);
    const facts =
      robot.error && robot.phase !== "connected"
        ? [robot.error]
        : [
            robot.may_move ? "may move" : "stands",
            robot.driver ? "driven" : "",
            robot.median === null ? "" : `${Math.round(1000 * robot.median)} ms`,
            robot.battery === null ? "" : `battery ${Math.round(100 * robot.battery)} %`,
            robot.pose ? `${number(robot.pose[0], 2)}, ${number(robot.pose[1], 2)} m` : "",
          ];
    say(card.facts, facts.filter(Boolean).join(" · "));
    card.box.classList.toggle("stale", robot.stale);
    this.paint(card.canvas, robot, ink);
  }

  /** @param {HTMLCanvasElement} canvas @param {Summary} robot @param {Record<string, string>} ink */
  paint(canvas, robot, ink) {
    const { pen, width, height } = fit(canvas);
    /** @type {Point} */
    const middle = [width / 2, height / 2],
      radius = Math.min(width, height) * 0.26;
    (robot.proximity ?? []).forEach((counts, sensor) => {
      const far = distance(counts),
        turn = this.sensors[sensor];
      if (!Number.isFinite(far)) return;
      const reach = radius * (1.15 + 0.06 * far);
      pen.beginPath();
      pen.arc(...middle, reach, -Math.PI / 2 - turn - 0.18, -Math.PI / 2 - turn + 0.18);
      pen.strokeStyle = far < 3 ? ink.bad : ink.accent;
      pen.lineWidth = 3;
      pen.stroke();
    });
    drawRobot(pen, middle, Math.PI / 2, radius, 0, DARK, this.leds, ink.edge);
  }
}
