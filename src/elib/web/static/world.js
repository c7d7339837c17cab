// The world of a virtual robot, live: the canvas, the model and the panel of the live view, fed by the page's own wire.

import { Arena } from "./arena.js";
import { Model } from "./model.js";
import { Panel } from "./details.js";
import { decode } from "./frames.js";
import { make, say } from "./dom.js";
import { Hand } from "./hand.js";
import { hub } from "./hub.js";

/** @import { Thing } from "./model.js" */
/** @import { App } from "./app.js" */
/** @import { Remote } from "./dom.js" */
/** @import { Change, Readings, Request, Scene } from "./frames.js" */

/** @typedef {Scene & { names: string[], own: number | null, floor_png: string | null }} Told a scene, as it is told */

export class Part {
  /** @param {HTMLElement} box @param {Remote | null} robot the robot of this page; null for all @param {App} app */
  constructor(box, robot, app) {
    this.app = app;
    this.model = new Model();
    /** @type {Map<string, Request | null>} */
    this.queued = new Map();
    this.hush = 0; // the timer that ends what is said
    box.classList.add("world");
    this.canvas = make("canvas", {
      tabIndex: 0,
      role: "application",
      "data-keys": "",
      "aria-label": "world from above: N and P select, arrow keys move, brackets turn",
    });
    this.tip = make("p", { className: "said", role: "status" });
    this.detail = make("div", { className: "detail" });
    this.ambient = make("input", { type: "range", min: 0, max: 4095, step: 5, id: "world-ambient" });
    this.ambientText = make("output");
    this.ambient.addEventListener("input", () => {
      say(this.ambientText, this.ambient.value);
      this.act({ do: "set_ambient", ambient: this.ambient.valueAsNumber });
    });
    this.list = make("select", {
      "aria-label": "thing in the world",
      onchange: () => this.select(this.model.find(this.list.value)),
    });
    this.arena = new Arena(this.canvas, this.model);
    this.panel = new Panel(
      this.detail,
      this.model,
      (message) => this.act(message),
      (by) => this.hand.turn(by),
    );
    this.hand = new Hand(this);
    box.append(
      make("div", { className: "stage" }, this.canvas, this.tip),
      make(
        "div",
        { className: "side" },
        make("label", { className: "field" }, make("span", { textContent: "Selected" }), this.list),
        this.detail,
        make(
          "label",
          { className: "slider", htmlFor: "world-ambient" },
          "Infrared in the room's light",
          this.ambientText,
          this.ambient,
        ),
        make("p", {
          className: "hint",
          textContent: "Counts of the ambient light reading: higher is darker. Drag a robot or a thing to move it.",
        }),
      ),
    );
    this.watch = new ResizeObserver(() => this.redress());
    this.watch.observe(this.canvas);
    this.theme = new MutationObserver(() => this.redress());
    this.theme.observe(document.documentElement, { attributeFilter: ["data-theme"] });
    this.unlisten = [
      hub.listen("scene", ({ scene }) => this.enter(scene)),
      hub.listen("change", (change) => this.take(change)),
      hub.listen("readings", (readings) => {
        this.model.readings = readings;
      }),
      hub.listen("frame", (frame) => this.draw(frame)),
    ];
  }

  close() {
    for (const unlisten of this.unlisten) unlisten();
    this.watch.disconnect();
    this.theme.disconnect();
  }

  redress() {
    this.arena.fit();
    this.arena.draw();
  }

  /** @param {Change} change */
  take(change) {
    if (!this.model.scene) return;
    this.model.change(change);
    if (change.ambient !== undefined) this.sayAmbient();
  }

  sayAmbient() {
    if (!this.model.scene) return;
    if (!this.ambient.matches(":active")) this.ambient.value = String(this.model.scene.ambient);
    say(this.ambientText, String(Math.round(this.model.scene.ambient)));
  }

  /** @param {ArrayBuffer} frame */
  draw(frame) {
    if (!this.model.scene) return;
    this.model.setFrame(decode(frame), performance.now() / 1000);
    if (!this.canvas.offsetParent) return;
    this.arena.draw();
    this.panel.renew();
  }

  /** @param {Told | null} scene */
  enter(scene) {
    if (!scene) return;
    this.model.setScene(scene);
    this.arena.floor = null;
    if (scene.floor_png) this.lay(scene.floor_png);
    this.sayAmbient();
    /** @type {HTMLElement} */ (this.canvas.parentElement).style.aspectRatio =
      `${Math.max(0.6, Math.min(2.2, scene.width / scene.depth))}`;
    this.list.replaceChildren(
      new Option("nothing", ""),
      ...this.model
        .groups()
        .flatMap(([, things]) => things.slice(0, 500).map((thing) => new Option(thing.name, thing.key))),
    );
    this.arena.fit();
    this.select(scene.own === null ? null : this.model.find(`robot:${scene.own}`));
  }

  /** @param {string} source */
  async lay(source) {
    const picture = new Image();
    picture.src = source;
    await picture.decode().catch(() => null);
    this.arena.floor = picture.naturalWidth ? picture : null;
    this.redress();
  }

  /** @param {Thing | null} thing */
  select(thing) {
    this.arena.selected = thing;
    this.model.readings = null;
    this.list.value = thing ? thing.key : "";
    this.app.connection.tell("watch", { index: thing && thing.kind === "robot" ? thing.index : null });
    this.panel.show(thing);
    if (this.model.frame) this.arena.draw();
  }

  /**
   * Ask for a change. Of several of a kind only the newest waits: a slider makes more than anybody needs.
   * @param {Request} message
   */
  act(message) {
    const kind = `${message.do} ${Object.keys(message)}`;
    if (this.queued.has(kind)) {
      this.queued.set(kind, message);
      return;
    }
    this.queued.set(kind, null);
    this.send(message);
    setTimeout(() => {
      const next = this.queued.get(kind);
      this.queued.delete(kind);
      if (next) this.act(next);
    }, 60);
  }

  /** @param {Request} message */
  async send(message) {
    const answer = await this.app.connection.ask("world", { message });
    const reply = answer.ok ? answer.result : answer;
    say(this.tip, reply.ok ? "" : `${reply.error}${reply.hint ? ` (${reply.hint})` : ""}`);
    this.tip.classList.toggle("on", !reply.ok);
    clearTimeout(this.hush);
    this.hush = setTimeout(() => this.tip.classList.remove("on"), 4000);
  }
}
