// What is known of the selected thing, and what can be switched there: a column beside the arena.

import { button, make, put, say } from "./dom.js";
import { degrees } from "./model.js";
import { SENSOR_NAMES } from "./robot.js";

/** @import { Thing } from "./model.js" */
/** @import { Frame, LinkFaults, Request } from "./frames.js" */
/** @import { Part } from "./world.js" */

/** @typedef {(value: number) => string} Text how a number is written */

// What the e-puck1 does at a key of the remote control (wire-protocol.md, 5.10).
const KEYS = ["sound", "", "forward", "", "left", "stop", "right", "", "back", ""];

const DARK = 4095; // counts of a light sensor without any light
const unfolded = new Set(["Infrared sensors"]); // the groups that are open; they outlive what is selected

/** @type {Text} */
const whole = (value) => `${Math.round(value)}`;
/** @type {Text} */
const tenths = (value) => value.toFixed(1);
/** @type {Text} */
const share = (value) => `${Math.round(100 * value)} %`;
/** @type {Text} */
const brightness = (counts) => share(1 - counts / DARK);
/** @type {Text} */
const milliseconds = (value) => `${Math.round(1000 * value)} ms`;
/** @type {[key: keyof LinkFaults, label: string, high: number, text: Text][]} */
const FAULTS = [
  // of a robot's link: key, label, highest, text
  ["loss", "Answers lost", 1, share],
  ["latency", "Delay of answers", 1, milliseconds],
  ["jitter", "Delay varies by ±", 0.5, milliseconds],
];

export class Details {
  /** @param {HTMLElement} box @param {Part} world */
  constructor(box, world) {
    this.box = box;
    this.world = world;
    this.model = world.model;
    /** @type {Thing | null} */
    this.thing = null;
    /** @type {Record<string, HTMLElement>} */
    this.facts = {};
    /** @type {[bar: HTMLElement, value: HTMLElement][]} */
    this.bars = [];
    /** @type {Record<string, [input: HTMLInputElement, value: HTMLElement, text: Text]>} */
    this.knobs = {};
    this.cut = make("input", { type: "checkbox", id: "world-link", role: "switch" });
    this.cut.onchange = () => this.hold(this.cut, { do: this.cut.checked ? "cut" : "mend", robot: this.index });
    this.script = make("p", { className: "hint" });
    this.selector = make(
      "select",
      { id: "world-selector" },
      ...Array.from({ length: 16 }, (_, position) => new Option(String(position))),
    );
    this.selector.onchange = () =>
      this.hold(this.selector, { do: "turn_selector", robot: this.index, position: Number(this.selector.value) });
    this.button = make("input", { type: "checkbox", id: "world-button", role: "switch" });
    this.button.onchange = () =>
      this.hold(this.button, { do: "press_button", robot: this.index, pressed: this.button.checked });
    this.buttonRow = make("label", { className: "switch" }, "User button held down", this.button);
    /** @type {Map<HTMLElement, number>} */
    this.held = new Map();
  }

  get index() {
    return this.thing?.index ?? 0;
  }

  /**
   * Show another thing, or the world as a whole.
   * @param {Thing | null} thing
   */
  show(thing) {
    this.thing = thing;
    this.facts = {};
    this.bars = [];
    this.knobs = {};
    this.held.clear();
    const kind = thing?.kind;
    this.box.replaceChildren(make("h3", { textContent: thing?.name ?? "Whole world" }));
    if (!thing) this.box.append(this.list("world", "size", "robots"), this.roomLight());
    else if (kind === "robot") this.buildRobot();
    else this.box.append(this.list(...(kind === "box" || kind === "wall" ? ["x", "y", "angle"] : ["x", "y"])));
    if (kind === "robot" || kind === "box" || kind === "wall") this.box.append(this.turners());
    if (kind === "light")
      this.box.append(this.slider("intensity", "Brightness", 10, tenths, { do: "set_light", light: this.index }));
    if (kind === "sound")
      this.box.append(this.slider("volume", "Volume at 0.1 m", 4095, whole, { do: "set_sound", sound: this.index }));
    if (kind === "robot") this.box.append(this.faults(), this.hands());
    this.renew();
  }

  /** @param {...string} names */
  list(...names) {
    const list = make("dl");
    for (const name of names) {
      this.facts[name] = make("dd", { textContent: "–" });
      list.append(make("dt", { textContent: name }), this.facts[name]);
    }
    return list;
  }

  roomLight() {
    const light = this.slider("ambient", "Light in the room", DARK, brightness, { do: "set_ambient" });
    this.knobs.ambient[0].dir = "rtl"; // it is counted as the light sensors do, low for bright: bright is at the right
    light.title = "From dark to bright. The light sensors of a robot read a higher number where it is darker.";
    return light;
  }

  buildRobot() {
    const bars = make("div", { className: "bars", role: "group", "aria-label": "infrared sensors, counts" });
    this.bars = SENSOR_NAMES.map((name, number) => {
      const bar = make("b"),
        value = make("span", { textContent: "–" });
      bars.append(
        make("span", { textContent: `IR${number} ${name}` }),
        make("i", { "aria-hidden": "true" }, bar),
        value,
      );
      return [bar, value];
    });
    this.box.append(
      this.list("x", "y", "heading", "speed", "turning", "wheel steps", "touches something"),
      group("Infrared sensors", make("p", { className: "hint", textContent: "True values, without noise" }), bars),
    );
  }

  turners() {
    const { hand } = this.world;
    return make(
      "div",
      { className: "row" },
      button("↺ 15°", () => hand.turn(Math.PI / 12), { "aria-label": "turn left by 15 degrees" }),
      button("↻ 15°", () => hand.turn(-Math.PI / 12), { "aria-label": "turn right by 15 degrees" }),
    );
  }

  faults() {
    return group(
      "Link of this robot",
      make("label", { className: "switch" }, "Cut the link", this.cut),
      ...FAULTS.map(([key, label, high, text]) =>
        this.slider(key, label, high, text, { do: "set_faults", robot: this.index }),
      ),
      this.script,
      button("Undo all faults", async () => {
        await this.world.send({ do: "set_faults", robot: this.index, loss: 0, latency: 0, jitter: 0 });
        if (this.cut.checked) await this.world.send({ do: "mend", robot: this.index });
      }),
    );
  }

  /** What a hand can do to the robot itself. */
  hands() {
    const key = make(
      "select",
      { "aria-label": "key of the remote control" },
      ...KEYS.map((what, number) => new Option(`${number} ${what}`, String(number))),
    );
    return group(
      "Robot's controls",
      make("label", { className: "switch", htmlFor: "world-selector" }, "Selector", this.selector),
      make(
        "div",
        { className: "switch" },
        "Remote control",
        key,
        button("Press", () => this.world.send({ do: "press_remote", robot: this.index, key: Number(key.value) })),
      ),
      this.buttonRow,
    );
  }

  /**
   * A slider from 0 for the value `key` of a request.
   * @param {string} key @param {string} label @param {number} high @param {Text} text @param {Request} message
   */
  slider(key, label, high, text, message) {
    const step = high > 100 ? 5 : high > 1 ? 0.1 : 0.01;
    const input = make("input", { type: "range", min: 0, max: high, step, id: `knob-${key}` }),
      value = make("output");
    input.oninput = () => {
      this.tell(key, input.valueAsNumber);
      this.hold(input, { ...message, [key]: input.valueAsNumber });
    };
    this.knobs[key] = [input, value, text];
    // An output is something a label can be for, too: without its name the label would be the output's.
    return make("label", { className: "slider", htmlFor: input.id }, label, value, input);
  }

  /** Put the newest numbers in. */
  renew() {
    const { model, thing } = this;
    if (!model.scene) return;
    this.set("ambient", model.scene.ambient);
    if (!thing) {
      const { world, width, depth, robots } = model.scene;
      this.say({ world, size: `${+width.toFixed(2)} × ${+depth.toFixed(2)} m`, robots: String(robots) });
      return;
    }
    if (!model.frame) return;
    const [x, y, angle] = model.pose(thing),
      turned = `${degrees(angle)}°`;
    this.say({ x: `${x.toFixed(3)} m`, y: `${y.toFixed(3)} m`, angle: turned, heading: turned });
    if (thing.kind === "light") this.set("intensity", model.things.light[thing.index].intensity);
    if (thing.kind === "sound") this.set("volume", model.things.sound[thing.index].volume);
    if (thing.kind === "robot") this.renewRobot(thing.index, model.frame);
  }

  /** @param {number} index @param {Frame} frame */
  renewRobot(index, frame) {
    const { readings, speeds } = this.model;
    this.say({
      speed: `${(100 * speeds[2 * index]).toFixed(1).replace("-0.0", "0.0")} cm/s`,
      turning: `${((speeds[2 * index + 1] * 180) / Math.PI).toFixed(0).replace(/^-0$/, "0")} °/s`,
      "touches something": frame.bits[index] & 1 ? "yes" : "no",
    });
    if (!readings || readings.robot !== index) return;
    this.say({ "wheel steps": `left ${readings.encoders[0]}, right ${readings.encoders[1]}` });
    readings.proximity.forEach((value, k) => {
      this.bars[k][0].style.width = `${Math.min(100, value / 40.95)}%`;
      say(this.bars[k][1], String(value));
    });
    const { link, base } = readings;
    if (!this.isHeld(this.cut)) this.cut.checked = link.cut;
    for (const [key] of FAULTS) this.set(key, link[key]);
    const own = FAULTS.filter(([key]) => base && base[key] > 0).map(
      ([key, label, , text]) => `${label.toLowerCase()} ${text(base?.[key] ?? 0)}`,
    );
    const notes = [
      own.length ? `The robot's URL adds: ${own.join(", ")}.` : "",
      link.script.length ? `The fault script does now: ${link.script.join(", ")}.` : "",
      link.connected || link.cut ? "" : "No program has opened this robot yet.",
    ];
    say(this.script, notes.filter(Boolean).join(" "));
    if (readings.selector !== undefined && !this.isHeld(this.selector)) this.selector.value = String(readings.selector);
    this.buttonRow.hidden = typeof readings.button !== "boolean";
    if (!this.isHeld(this.button)) this.button.checked = readings.button === true;
  }

  /** @param {Record<string, string>} texts */
  say(texts) {
    for (const [name, text] of Object.entries(texts)) if (this.facts[name]) say(this.facts[name], text);
  }

  /**
   * Ask for a change, and let a control show what was asked for until news from after the answer are here: older ones
   * would turn it back.
   * @param {HTMLElement} control
   * @param {Request} message
   */
  async hold(control, message) {
    const held = this.held;
    held.set(control, Infinity);
    if ((await this.world.act(message)) === null) return; // one of its kind is under way, which ends this, too
    this.model.readings = null;
    // The next frame may have been taken before the answer was given.
    held.set(control, (this.model.frame?.number ?? 0) + 2);
  }

  /** @param {HTMLElement} control */
  isHeld(control) {
    return (this.model.frame?.number ?? 0) < (this.held.get(control) ?? 0);
  }

  /**
   * Let a slider show a value, unless a hand is on it.
   * @param {string} key
   * @param {number} value
   */
  set(key, value) {
    const knob = this.knobs[key];
    if (!knob || knob[0].matches(":active") || this.isHeld(knob[0])) return;
    if (knob[0].valueAsNumber !== value) knob[0].value = String(value);
    this.tell(key, value);
  }

  /** @param {string} key @param {number} value */
  tell(key, value) {
    const [input, output, text] = this.knobs[key];
    say(output, text(value));
    put(input, "aria-valuetext", text(value));
  }
}

/**
 * A group that can be folded.
 * @param {string} title @param {...Node} children
 */
function group(title, ...children) {
  const box = make("details", { open: unfolded.has(title) }, make("summary", { textContent: title }), ...children);
  box.addEventListener("toggle", () => unfolded[box.open ? "add" : "delete"](title));
  return box;
}
