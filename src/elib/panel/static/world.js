// The world of a virtual robot, live, and what a hand can do in it; without one, the robot's path.

import { Arena } from "./arena.js";
import { Details } from "./details.js";
import { button, confirmed, make, say } from "./dom.js";
import { decode } from "./frames.js";
import { Hand } from "./hand.js";
import { hub } from "./hub.js";
import { Model } from "./model.js";
import { Part as Path } from "./path.js";

/** @import { App } from "./app.js" */
/** @import { Remote } from "./dom.js" */
/** @import { Change, Frame, Readings, Request, Scene } from "./frames.js" */
/** @import { Known } from "./hub.js" */
/** @import { Thing } from "./model.js" */

const PACE = 40; // ms between two requests of a kind
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 10];
const NEAR = 3; // times: the zoom for following a robot
const STEP = 0.1; // s
const HUSH = 6000; // ms that an answer is shown
const BOX = 0.1,
  WALL = 0.3; // m
const TRIALS = 40; // places where a new thing may have room
const KEYS = "N P select, arrows move, [ ] turn, + − 0 zoom, B box, M wall, Delete deletes";

const choices = { rays: false, details: false }; // they outlive a page of a robot

export class Part {
  /** @param {HTMLElement} box @param {Remote | null} robot the robot of this page; null for all @param {App} app */
  constructor(box, robot, app) {
    this.app = app;
    this.title = make("h2", { textContent: robot ? "Path" : "" });
    this.model = new Model();
    /** @type {Map<string, Request | null>} */
    this.queued = new Map();
    this.hush = 0; // the timer that ends what is said
    this.added = ""; // the key of a thing that was added, and will be selected as soon as it is here
    box.classList.add("world-part");
    this.canvas = make("canvas", {
      tabIndex: 0,
      role: "application",
      title: KEYS,
      "aria-label": `world from above: ${KEYS}`,
    });
    this.tip = make("p", { className: "said", role: "status" });
    this.list = make("select", {
      "aria-label": "thing in the world",
      onchange: () => this.select(this.model.find(this.list.value)),
    });
    this.pauseButton = button("Pause world", () => this.send({ do: this.isPaused ? "resume" : "pause" }), {
      title: "The world stands still, and the robots' firmware with it. Programs outside get no answers meanwhile.",
    });
    this.stepButton = button("Step", () => this.send({ do: "step", seconds: STEP }), {
      title: `Go on by ${STEP} s; only while paused`,
    });
    this.speed = make(
      "select",
      { "aria-label": "speed of the world" },
      ...SPEEDS.map((speed) => new Option(`× ${speed}`, String(speed))),
    );
    this.speed.onchange = () => this.send({ do: "set_speed", speed: Number(this.speed.value) });
    this.time = make("output", { className: "time" });
    this.followBox = make("input", { type: "checkbox" });
    this.followBox.onchange = () => this.follow(this.followBox.checked ? this.robotToFollow : null);
    this.raysBox = make("input", { type: "checkbox", checked: choices.rays });
    this.raysBox.onchange = () => {
      choices.rays = this.raysBox.checked;
      app.connection.tell("rays", { on: choices.rays });
    };
    this.removeButton = button("Delete", () => this.remove(), { title: "Take the selected box or wall away" });
    this.arena = new Arena(this.canvas, this.model, app.hello?.ring.leds ?? []);
    this.hand = new Hand(this);
    for (const name of ["focus", "blur"]) this.canvas.addEventListener(name, () => this.sayArrows());
    const detail = make("aside", { className: "detail", id: "world-detail", "aria-label": "what is selected" });
    this.details = new Details(detail, this);
    const stage = make(
      "div",
      { className: "stage" },
      make("div", { className: "view" }, this.canvas, this.tip),
      detail,
    );
    this.live = make("div", { className: "live" }, this.clockBar(), stage, this.thingBar(detail));
    this.live.hidden = true;
    const map = make("div");
    this.path = robot ? new Path(map, app) : null;
    this.map = map;
    box.append(this.title, this.live, map);
    this.watch = new ResizeObserver(() => this.redress());
    this.watch.observe(this.canvas);
    this.theme = new MutationObserver(() => this.redress());
    this.theme.observe(document.documentElement, { attributeFilter: ["data-theme"] });
    app.connection.tell("rays", { on: choices.rays });
    let isOld = true; // the hub repeats the last news of each channel, which may be of another world
    /** @param {string} channel @param {(news: any) => void} take */
    const listen = (channel, take) => hub.listen(channel, (news) => isOld || take(news));
    this.unlisten = [
      hub.listen("scene", ({ scene }) => this.enter(scene)),
      listen("change", (/** @type {Change} */ change) => this.take(change)),
      listen("readings", (/** @type {Readings} */ readings) => {
        this.model.readings = readings;
      }),
      listen("frame", (frame) => this.draw(decode(frame))),
    ];
    isOld = false;
  }

  clockBar() {
    const follow = make("label", { className: "check", title: "Keep the selected robot in the middle" });
    follow.append(this.followBox, "Follow");
    const rays = make("label", { className: "check", title: "Show what the infrared sensors see" });
    rays.append(this.raysBox, "Rays");
    return make(
      "div",
      { className: "tools" },
      this.pauseButton,
      this.stepButton,
      this.speed,
      this.time,
      follow,
      rays,
      make(
        "span",
        {},
        button("−", () => this.zoom(0.7), { "aria-label": "zoom out" }),
        button("+", () => this.zoom(1.4), { "aria-label": "zoom in" }),
        button("Fit", () => this.showAll(), { title: "Show the whole world" }),
      ),
    );
  }

  /** @param {HTMLElement} detail */
  thingBar(detail) {
    const fold = button("Details", () => show(!choices.details), { "aria-controls": detail.id });
    /** @param {boolean} on */
    const show = (on) => {
      choices.details = on;
      detail.hidden = !on;
      fold.setAttribute("aria-expanded", String(on));
      this.details.renew();
    };
    show(choices.details);
    return make(
      "div",
      { className: "tools" },
      this.list,
      fold,
      button("+ Box", () => this.add("box"), { title: "Put a box into the world; then drag it" }),
      button("+ Wall", () => this.add("wall"), { title: "Put a wall into the world; then drag and turn it" }),
      this.removeButton,
      button("Save …", () => this.save(), { title: "Save this world as a file" }),
    );
  }

  close() {
    for (const unlisten of this.unlisten) unlisten();
    this.watch.disconnect();
    this.theme.disconnect();
    this.path?.close();
    this.app.connection.tell("watch", { index: null });
  }

  /** @param {Known} robot */
  show(robot) {
    if (!this.model.scene) this.path?.show(robot);
  }

  redress() {
    this.arena.fit();
    this.arena.draw();
  }

  // What the world says

  get isPaused() {
    return this.model.scene?.clock.paused ?? false;
  }

  /** @param {Scene | null} scene */
  enter(scene) {
    // After a disconnect the world stays as it was seen last; nothing can be done in it.
    const isLive = scene !== null || (this.path !== null && this.model.scene !== null);
    this.live.hidden = !isLive;
    this.live.inert = !scene;
    this.map.hidden = isLive;
    this.title.textContent = isLive ? `World: ${(scene ?? this.model.known).world}` : "Path";
    if (!scene) {
      if (isLive) say(this.time, "disconnected");
      else this.model.scene = null;
      return;
    }
    this.model.setScene(scene);
    this.arena.floor = null;
    if (scene.floor_png) this.lay(scene.floor_png);
    this.arena.zoom = 1;
    this.follow(null);
    this.arena.fit();
    this.sayClock();
    this.fill();
    this.select(scene.own === null ? null : this.model.thing("robot", scene.own));
  }

  /** @param {Change} change */
  take(change) {
    if (!this.model.scene) return;
    this.model.change(change);
    if (change.clock) this.sayClock();
    if (change.walls) this.arena.place();
    if (!change.walls && !change.all_boxes) return;
    this.fill();
    const selected = this.model.find(this.added) ?? this.model.find(this.arena.selected?.key ?? "");
    this.added = "";
    this.select(selected);
  }

  /** @param {Frame} frame */
  draw(frame) {
    if (frame.count !== this.model.scene?.robots) return;
    this.model.setFrame(frame, performance.now() / 1000);
    if (!this.canvas.offsetParent) return;
    this.arena.draw();
    this.sayTime();
    if (choices.details) this.details.renew();
  }

  sayClock() {
    const { paused, speed, fixed } = this.model.known.clock;
    say(this.pauseButton, paused ? "Continue world" : "Pause world");
    this.stepButton.disabled = !paused;
    this.speed.disabled = fixed !== "";
    this.speed.title = fixed ? `The speed cannot be changed: ${fixed}` : "Programs keep their own time";
    if (!SPEEDS.includes(speed)) this.speed.add(new Option(`× ${speed}`, String(speed)));
    this.speed.value = String(speed);
    this.model.clock = [];
  }

  sayTime() {
    const { frame, ratio, known } = this.model;
    if (!frame) return;
    const wanted = known.clock.speed;
    const isSlow = ratio !== null && !this.isPaused && ratio < 0.85 * wanted;
    const note = this.isPaused ? " paused" : isSlow ? ` only × ${ratio.toFixed(1)}` : "";
    say(this.time, `${frame.time.toFixed(1)} s${note}`);
  }

  /** @param {string} source */
  async lay(source) {
    const picture = new Image();
    picture.src = source;
    await picture.decode().catch(() => null);
    this.arena.floor = picture.naturalWidth ? picture : null;
    this.redress();
  }

  /** List everything that can be selected. */
  fill() {
    this.list.replaceChildren(
      new Option("whole world", ""),
      ...this.model.all().map((thing) => new Option(thing.name, thing.key)),
    );
  }

  // What is looked at

  /** @param {Thing | null} thing */
  select(thing) {
    this.arena.selected = thing;
    this.model.readings = null;
    this.list.value = thing ? thing.key : "";
    this.removeButton.disabled = thing?.kind !== "box" && thing?.kind !== "wall";
    this.app.connection.tell("watch", { index: thing?.kind === "robot" ? thing.index : null });
    if (thing?.kind === "robot" && this.arena.followed !== null) this.follow(thing.index);
    this.details.show(thing);
    this.sayArrows();
    if (this.model.frame) this.arena.draw();
  }

  get isOwnSelected() {
    return this.arena.selected?.key === `robot:${this.model.scene?.own}`;
  }

  /** Tell the pad what the arrow keys move while the world has the focus; nothing is the robot of this page. */
  sayArrows() {
    const moved = this.arena.selected?.name ?? "the view",
      detail = document.activeElement === this.canvas && !this.isOwnSelected ? moved : "";
    window.dispatchEvent(new CustomEvent("elib-arrows", { detail }));
  }

  get robotToFollow() {
    const { selected } = this.arena;
    return selected?.kind === "robot" ? selected.index : (this.model.scene?.own ?? 0);
  }

  /** @param {number | null} robot */
  follow(robot) {
    this.arena.followed = robot;
    this.followBox.checked = robot !== null;
    if (robot !== null && this.arena.zoom < NEAR) this.zoom(NEAR / this.arena.zoom);
  }

  /** @param {number} factor @param {number} [left] @param {number} [top] */
  zoom(factor, left, top) {
    this.arena.zoomBy(factor, left, top);
    this.arena.draw();
  }

  showAll() {
    this.follow(null);
    this.arena.zoom = 1;
    this.arena.place();
    this.arena.draw();
  }

  /**
   * Open the page of a robot.
   * @param {number} index
   */
  open(index) {
    if (index !== this.model.scene?.own) this.app.ask("open_robot", { index });
  }

  // What is changed

  /**
   * Ask for a change. Of several of a kind only the newest waits: a slider makes more than anybody needs.
   * @param {Request} message
   * @returns {Promise<unknown>} null if another one of its kind is under way
   */
  async act(message) {
    const kind = `${message.do} ${Object.keys(message)}`;
    const isFirst = !this.queued.has(kind);
    this.queued.set(kind, message);
    if (!isFirst) return null;
    /** @type {unknown} */
    let reply;
    for (let next; (next = this.queued.get(kind));) {
      this.queued.set(kind, null);
      [reply] = await Promise.all([this.send(next), new Promise((resolve) => setTimeout(resolve, PACE))]);
    }
    this.queued.delete(kind);
    return reply;
  }

  /** @param {Request} message @param {boolean} [isTrial] a refusal is not shown */
  async send(message, isTrial = false) {
    const answer = await this.app.connection.ask("world", { message });
    const reply = answer.ok ? answer.result : answer;
    if (!isTrial) this.say(reply.ok ? "" : `${reply.error}${reply.hint ? ` (${reply.hint})` : ""}`);
    return reply;
  }

  /** @param {string} text */
  say(text) {
    if (text) say(this.tip, text);
    this.tip.classList.toggle("on", text !== "");
    clearTimeout(this.hush);
    if (text) this.hush = setTimeout(() => this.tip.classList.remove("on"), HUSH);
  }

  /**
   * Put a box or a wall where there is room, as near to the middle of what is in view as can be.
   * @param {"box" | "wall"} kind
   */
  async add(kind) {
    const [middleX, middleY] = this.arena.middle,
      half = kind === "box" ? BOX / 2 : WALL / 2;
    /** @type {any} */
    let reply;
    for (let turn = 0; turn < TRIALS; turn++) {
      const far = half * Math.sqrt(turn); // a spiral
      const [x, y] = [middleX + far * Math.cos(2.4 * turn), middleY + far * Math.sin(2.4 * turn)];
      const place = kind === "box" ? { x, y } : { x1: x - half, y1: y, x2: x + half, y2: y };
      reply = await this.send({ do: `add_${kind}`, ...place }, true);
      if (reply.ok || !reply.error.includes("no room")) break;
    }
    if (!reply.ok) return this.say(reply.error);
    this.added = `${kind}:${reply.result}`;
    const thing = this.model.find(this.added);
    if (thing) this.select(thing);
  }

  remove() {
    const { selected } = this.arena;
    if (selected?.kind === "box" || selected?.kind === "wall") {
      this.select(null);
      return this.send({ do: `remove_${selected.kind}`, [selected.kind]: selected.index });
    }
  }

  async save() {
    const name = make("input", { type: "text", value: `${this.model.known.world}-2`, maxLength: 70, required: true });
    const field = make("label", { className: "field" }, "Name", name);
    const text = "Everything is saved where it stands now, robots too.";
    if (!(await confirmed("Save this world", text, "Save", field))) return;
    const answer = await this.app.ask("save_world", { name: name.value });
    if (answer.ok) this.app.toast(`Saved as ${answer.result.name}. Open it again as ${answer.result.url}`);
  }
}
