// All robots at a glance, with their world, and what can be done with all of them at once.

import { button, fit, inks, make, put, say } from "./dom.js";
import { hub } from "./hub.js";
import { drawRobot } from "./robotshape.js";
import { Part as Study } from "./study.js";
import { Part as World } from "./world.js";

/** @import { App } from "./app.js" */
/** @import { Summary } from "./hub.js" */
/** @import { Point } from "./robotshape.js" */

/** @typedef {ReturnType<OverviewPlace["card"]>} Card */

const LOW = 0.2; // of the battery, from which on it is worth a word
const SLOW = 0.3; // s until an answer, from which on it is worth a word

export class OverviewPlace {
  /** @param {App} app */
  constructor(app) {
    this.app = app;
    /** @type {Map<string, Card>} */
    this.cards = new Map();
    this.ring = app.hello?.ring ?? { sensors: [], leds: [] };
    const stage = make("div");
    this.world = new World(stage, null, app);
    const world = make("section", { className: "card part-world", "aria-label": "world", hidden: true }, stage);
    this.worlds = make("select", {
      "aria-label": "world that is shown",
      hidden: true,
      onchange: () => this.choose(),
    });
    this.world.title.after(this.worlds);
    this.list = make("div", { className: "robot-cards" });
    this.box = make("div", { className: "overview-place" }, world);
    if (app.hello?.study) {
      const card = make("section", { className: "card study all", "aria-label": "study" });
      this.study = new Study(card, app, app.hello.study);
      this.box.append(card);
    }
    if (!app.hello?.simulation)
      this.box.append(
        make(
          "section",
          { className: "card all", "aria-label": "all robots" },
          make("h2", { textContent: "All robots" }),
          this.bar(),
          this.list,
        ),
      );
    this.unlisten = [
      hub.listen("overview", (robots) => this.take(robots)),
      hub.listen("worlds", (worlds) => this.offer(worlds)),
      hub.listen("scene", ({ scene }) => {
        world.hidden = !scene;
      }),
    ];
  }

  close() {
    for (const unlisten of this.unlisten) unlisten();
    this.world.close();
    this.study?.close();
  }

  /** @param {[robot: string, name: string][]} worlds a robot of each, and its name */
  offer(worlds) {
    this.worlds.hidden = worlds.length < 2;
    this.world.title.hidden = !this.worlds.hidden; // the choice says it
    const { value, dataset } = this.worlds;
    if (dataset.worlds === String(worlds)) return;
    dataset.worlds = String(worlds);
    const label = (/** @type {string} */ key) => this.app.robots.find((each) => each.key === key)?.label ?? "";
    this.worlds.replaceChildren(...worlds.map(([key, name]) => new Option(`World: ${name}, with ${label(key)}`, key)));
    if (worlds.some(([key]) => key === value)) this.worlds.value = value;
    this.choose();
  }

  choose() {
    this.app.connection.tell("choose_world", { robot: this.worlds.value });
  }

  bar() {
    const { app } = this;
    const names = (app.hello?.behaviours ?? []).filter((each) => !each.elsewhere).map((each) => each.name);
    const choice = make(
      "select",
      { "aria-label": "behaviour for all robots" },
      ...names.map((name) => new Option(name)),
    );
    choice.value = "avoid";
    /** @type {(what: string, values?: object) => () => Promise<unknown>} */
    const all = (what, values) => () => app.ask(what, { robots: app.robots.map((each) => each.key), ...values });
    this.running = [
      button("Pause all", all("pause_behaviour")),
      button("Continue all", all("resume_behaviour")),
      button("End all", all("end_behaviour")),
    ];
    this.connecting = button("Connect all", () =>
      Promise.all(app.robots.map(({ key }) => app.ask("connect", { robot: key }))),
    );
    return make(
      "div",
      { className: "row wrap" },
      this.connecting,
      choice,
      button("Start for all", () => all("behave", { name: choice.value })(), { className: "primary" }),
      ...this.running,
    );
  }

  /** @param {Record<string, Summary>} robots */
  take(robots) {
    const ink = inks("accent", "bad", "edge"),
      all = Object.values(robots);
    if (this.connecting) this.connecting.disabled = all.every(({ phase }) => phase === "connected");
    for (const each of this.running ?? []) each.disabled = !all.some(({ behaviour }) => behaviour);
    for (const [key, card] of this.cards)
      if (!(key in robots)) {
        card.box.remove();
        this.cards.delete(key);
      }
    for (const [key, robot] of Object.entries(robots)) {
      const card = this.cards.get(key) ?? this.card(key);
      this.fill(card, this.app.robots.find((each) => each.key === key)?.label ?? "", robot);
      this.paint(card.canvas, robot, ink);
    }
  }

  /** @param {string} key */
  card(key) {
    const { app } = this;
    const canvas = make("canvas", { "aria-hidden": "true" }),
      chip = make("p", { className: "chip", role: "img" }),
      facts = make("p", { className: "hint" }),
      name = button("", () => app.open(key), { className: "link-like" }),
      stop = button("Stop", () => app.connection.tell("stop", { robot: key })),
      blink = button("Blink", () => app.ask("blink", { robot: key }), {
        title: "All LEDs of this robot blink, so that you find it",
      });
    const box = make("article", {}, canvas, name, chip, facts, stop, blink);
    const card = { box, canvas, chip, facts, name, stop, blink };
    this.cards.set(key, card);
    this.list.append(box);
    return card;
  }

  /** @param {Card} card @param {string} label @param {Summary} robot */
  fill(card, label, robot) {
    say(card.name, label);
    put(card.name, "title", robot.url);
    put(card.stop, "aria-label", `stop ${label}`);
    put(card.stop, "class", robot.may_move ? "stop small" : "plain");
    put(card.blink, "aria-label", `let ${label} blink`);
    card.chip.dataset.phase = robot.phase;
    // That all is well needs no word in each of twenty lines.
    say(card.chip, robot.phase === "connected" ? robot.behaviour : robot.phase_text);
    const state = robot.behaviour ? `${robot.phase_text}, ${robot.behaviour}` : robot.phase_text;
    for (const name of ["title", "aria-label"]) put(card.chip, name, state);
    const facts =
      robot.error && robot.phase !== "connected"
        ? [robot.error]
        : [
            robot.may_move ? "moving" : "",
            robot.driver ? "driven by a person" : "",
            robot.median === null || robot.median < SLOW ? "" : `slow: ${Math.round(1000 * robot.median)} ms`,
            robot.battery === null || robot.battery > LOW ? "" : `battery ${Math.round(100 * robot.battery)} %`,
          ];
    say(card.facts, facts.filter(Boolean).join(" · "));
    card.box.classList.toggle("stale", robot.stale);
  }

  /** @param {HTMLCanvasElement} canvas @param {Summary} robot @param {Record<string, string>} ink */
  paint(canvas, robot, ink) {
    const { pen, width, height } = fit(canvas);
    /** @type {Point} */
    const middle = [width / 2, height / 2],
      radius = Math.min(width, height) * 0.26;
    robot.distances.forEach((metres, sensor) => {
      if (metres === null) return;
      const far = 100 * metres,
        turn = -Math.PI / 2 - this.ring.sensors[sensor];
      pen.beginPath();
      pen.arc(...middle, radius * (1.15 + 0.06 * far), turn - 0.18, turn + 0.18);
      pen.strokeStyle = far < 3 ? ink.bad : ink.accent;
      pen.lineWidth = 3;
      pen.stroke();
    });
    drawRobot(pen, [...middle, Math.PI / 2], radius, ink.edge, this.ring.leds);
  }
}
