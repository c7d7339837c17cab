// All robots at a glance, with their world, and what can be done with all of them at once.

import { fit, inks, make, pending, put, say } from "./dom.js";
import { hub } from "./hub.js";
import { distance } from "./robot.js";
import { drawRobot } from "./robotshape.js";
import { Part as World } from "./world.js";

/** @import { App } from "./app.js" */
/** @import { Summary } from "./hub.js" */
/** @import { Point } from "./robotshape.js" */

/** @typedef {ReturnType<OverviewPlace["card"]>} Card */

const DARK = new Uint8Array(24); // no LED is lit

export class OverviewPlace {
  /** @param {App} app */
  constructor(app) {
    this.app = app;
    /** @type {Map<string, Card>} */
    this.cards = new Map();
    const ring = app.hello?.ring ?? { sensors: [], leds: [] };
    this.sensors = ring.sensors.map((degrees) => (degrees * Math.PI) / 180);
    this.leds = ring.leds.map((degrees) => (degrees * Math.PI) / 180);
    const stage = make("div");
    this.world = new World(stage, null, app);
    this.worldBox = make(
      "section",
      { className: "card part-world", "aria-label": "world" },
      make("h2", { textContent: "World" }),
      stage,
    );
    this.list = make("div", { className: "robot-cards" });
    this.box = make("div", { className: "overview-place" }, this.worldBox);
    if (!app.hello?.simulation)
      this.box.append(make("section", { className: "card all", "aria-label": "all robots" }, this.bar(), this.list));
    this.worldBox.hidden = true;
    this.unlisten = [
      hub.listen("overview", (robots) => this.take(robots)),
      hub.listen("scene", ({ scene }) => {
        this.worldBox.hidden = !scene;
      }),
    ];
  }

  close() {
    for (const unlisten of this.unlisten) unlisten();
    this.world.close();
  }

  bar() {
    const names = (this.app.hello?.behaviours ?? []).filter((each) => !each.elsewhere).map((each) => each.name);
    const choice = make(
      "select",
      { "aria-label": "behaviour for all robots" },
      ...names.map((name) => new Option(name)),
    );
    choice.value = "avoid";
    const all = () => ({ robots: this.app.robots.map((each) => each.key) });
    /** @type {(text: string, act: () => Promise<unknown>, kind?: string) => HTMLButtonElement} */
    const button = (text, act, kind = "plain") => {
      const made = make("button", { type: "button", className: kind, textContent: text });
      made.addEventListener("click", () => pending(made, act()));
      return made;
    };
    return make(
      "div",
      { className: "row wrap" },
      make("h2", { textContent: "All robots" }),
      button("Connect all", () =>
        Promise.all(this.app.robots.map((each) => this.app.ask("connect", { robot: each.key }))),
      ),
      choice,
      button("Start for all", () => this.app.ask("behave", { ...all(), name: choice.value }), "primary"),
      button("Pause all", () => this.app.ask("pause_behaviour", all())),
      button("Continue all", () => this.app.ask("resume_behaviour", all())),
      button("End all", () => this.app.ask("end_behaviour", all())),
    );
  }

  /** @param {Record<string, Summary>} robots */
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
        this.list.append(card.box);
      }
      this.fill(card, key, robot, ink);
    }
  }

  /** @param {string} key */
  card(key) {
    const canvas = make("canvas", { "aria-hidden": "true" }),
      chip = make("p", { className: "chip" }),
      facts = make("p", { className: "hint" }),
      name = make("button", { type: "button", className: "name", onclick: () => this.app.open(key) });
    const blink = make("button", { type: "button", className: "plain", textContent: "Blink" });
    blink.title = "All LEDs of this robot blink, so that you find it";
    blink.addEventListener("click", () => pending(blink, this.app.ask("blink", { robot: key })));
    const stop = make("button", {
      type: "button",
      className: "stop small",
      textContent: "Stop",
      onclick: () => this.app.connection.tell("stop", { robot: key }),
    });
    const box = make("article", {}, canvas, make("div", {}, name, chip, facts), make("div", {}, stop, blink));
    return { box, canvas, chip, facts, name, stop, blink };
  }

  /** @param {Card} card @param {string} key @param {Summary} robot @param {Record<string, string>} ink */
  fill(card, key, robot, ink) {
    const label = this.app.robots.find((each) => each.key === key)?.label ?? robot.name;
    say(card.name, label);
    put(card.name, "title", robot.url);
    put(card.stop, "aria-label", `stop ${label}`);
    put(card.blink, "aria-label", `let ${label} blink`);
    card.chip.dataset.phase = robot.phase;
    say(card.chip, robot.behaviour ? `${robot.phase_text}, ${robot.behaviour}` : robot.phase_text);
    const facts =
      robot.error && robot.phase !== "connected"
        ? [robot.error]
        : [
            robot.may_move ? "may move" : "stands still",
            robot.driver ? "driven by a person" : "",
            robot.median === null ? "" : `${Math.round(1000 * robot.median)} ms`,
            robot.battery === null ? "" : `battery ${Math.round(100 * robot.battery)} %`,
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
      pen.beginPath();
      pen.arc(...middle, radius * (1.15 + 0.06 * far), -Math.PI / 2 - turn - 0.18, -Math.PI / 2 - turn + 0.18);
      pen.strokeStyle = far < 3 ? ink.bad : ink.accent;
      pen.lineWidth = 3;
      pen.stroke();
    });
    drawRobot(pen, middle, Math.PI / 2, radius, 0, DARK, this.leds, ink.edge);
  }
}
