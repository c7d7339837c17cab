// The panel beside the arena: what is selected, its readings, and what can be switched.

import { degrees } from "./model.js";

/** @import { Model, Thing } from "./model.js" */
/** @import { Frame, LinkFaults, Reply, Request } from "./frames.js" */

/** @typedef {(value: number) => string} Text how a number is written */
/** @typedef {Promise<Reply | null> | void} Answer null while an older request of the kind is under way */

const SENSORS = [
  "front right",
  "diagonal right",
  "right",
  "rear right",
  "rear left",
  "left",
  "diagonal left",
  "front left",
];

/** @type {[key: keyof LinkFaults, label: string, high: number, step: number, text: Text][]} */
const KNOBS = [
  // of a robot's link: key, label, highest, step, text
  ["loss", "Answers lost", 1, 0.01, (value) => `${Math.round(100 * value)} %`],
  ["latency", "Answers later by", 1, 0.01, (value) => `${Math.round(1000 * value)} ms`],
  ["jitter", "Jitter of that", 0.5, 0.01, (value) => `${Math.round(1000 * value)} ms`],
];

/**
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Record<string, any>} attributes
 * @param {...(Node | string)} children
 */
function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name in element && name !== "list") Object.assign(element, { [name]: value });
    else element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

export class Panel {
  /**
   * @param {HTMLElement} box
   * @param {Model} model
   * @param {(message: Request) => Answer} act called with a message for the simulation
   * @param {(by: number) => void} turn called with rad for the selected thing
   */
  constructor(box, model, act, turn) {
    this.box = box;
    this.model = model;
    this.act = act;
    this.turn = turn;
    /** @type {Thing | null} */
    this.thing = null;
    /** @type {Record<string, HTMLElement>} */
    this.parts = {};
    /** @type {[bar: HTMLElement, value: HTMLElement][]} */
    this.bars = [];
    /** @type {Record<string, [input: HTMLInputElement, value: HTMLElement, text: Text]>} */
    this.knobs = {};
    /** @type {HTMLInputElement | null} */
    this.link = null;
    /** @type {Map<HTMLElement, number>} */
    this.held = new Map();
  }

  /**
   * Show another thing, or nothing.
   * @param {Thing | null} thing
   */
  show(thing) {
    this.thing = thing;
    this.parts = {};
    this.bars = [];
    this.knobs = {};
    this.link = null;
    this.held.clear();
    this.box.replaceChildren();
    if (!thing)
      this.box.append(
        make("p", { className: "hint", textContent: "Click something in the arena, or choose it above." }),
      );
    else if (thing.kind === "robot") this.buildRobot(thing.index);
    else this.buildThing(thing);
    this.renew();
  }

  /** @param {number} robot */
  buildRobot(robot) {
    const facts = make("dl");
    for (const name of ["x", "y", "heading", "speed", "turning", "wheel steps", "contact"]) {
      this.parts[name] = make("dd", { textContent: "–" });
      facts.append(make("dt", { textContent: name }), this.parts[name]);
    }
    const bars = make("div", { className: "bars", role: "group", "aria-label": "infrared sensors, counts" });
    this.bars = SENSORS.map((name) => {
      const bar = make("b"),
        value = make("span", { textContent: "–" });
      bars.append(make("span", { textContent: name }), make("i", { "aria-hidden": "true" }, bar), value);
      return [bar, value];
    });
    this.box.append(facts, bars, this.turners(), this.buildLink(robot));
  }

  turners() {
    return make(
      "div",
      { className: "buttons" },
      make("button", {
        type: "button",
        textContent: "↺ 15°",
        "aria-label": "turn left by 15 degrees",
        onclick: () => this.turn(Math.PI / 12),
      }),
      make("button", {
        type: "button",
        textContent: "↻ 15°",
        "aria-label": "turn right by 15 degrees",
        onclick: () => this.turn(-Math.PI / 12),
      }),
    );
  }

  /** @param {number} robot */
  buildLink(robot) {
    const isThere = make("input", { type: "checkbox", id: "link", role: "switch", checked: true });
    isThere.onchange = () => this.hold(isThere, this.act({ do: isThere.checked ? "mend" : "cut", robot }));
    this.link = isThere;
    const field = make(
      "fieldset",
      {},
      make("legend", { textContent: "Link" }),
      make("label", { className: "switch" }, "The link holds", isThere),
    );
    for (const [key, label, high, step, text] of KNOBS) {
      field.append(
        this.slider(key, label, high, step, text, (value) => this.act({ do: "set_faults", robot, [key]: value })),
      );
    }
    const base = this.model.known.link;
    const own = KNOBS.filter(([key]) => base[key] > 0).map(
      ([key, label, , , text]) => `${label.toLowerCase()}: ${text(base[key])}`,
    );
    if (own.length)
      field.append(make("p", { className: "hint", textContent: `On top of the simulation's own: ${own.join(", ")}.` }));
    return field;
  }

  /**
   * @param {string} key
   * @param {string} label
   * @param {number} high
   * @param {number} step
   * @param {Text} text
   * @param {(value: number) => Answer} act
   */
  slider(key, label, high, step, text, act) {
    const input = make("input", { type: "range", min: 0, max: high, step, id: `knob-${key}` }),
      value = make("output");
    input.oninput = () => {
      value.textContent = text(input.valueAsNumber);
      this.hold(input, act(input.valueAsNumber));
    };
    this.knobs[key] = [input, value, text];
    // An output is something a label can be for, too: without its name the label would be the output's.
    return make("label", { className: "slider", htmlFor: input.id }, label, value, input);
  }

  /** @param {Thing} thing */
  buildThing(thing) {
    const { kind, index } = thing;
    const facts = make("dl");
    for (const name of kind === "box" ? ["x", "y", "angle"] : ["x", "y"]) {
      this.parts[name] = make("dd", { textContent: "–" });
      facts.append(make("dt", { textContent: name }), this.parts[name]);
    }
    this.box.append(facts);
    if (kind === "box") this.box.append(this.turners());
    if (kind === "light") {
      this.box.append(
        this.slider(
          "intensity",
          "Intensity",
          10,
          0.1,
          (value) => value.toFixed(1),
          (intensity) => this.act({ do: "set_light", light: index, intensity }),
        ),
      );
    }
    if (kind === "sound") {
      this.box.append(
        this.slider(
          "volume",
          "Volume at 0.1 m",
          4095,
          5,
          (value) => `${Math.round(value)} counts`,
          (volume) => this.act({ do: "set_sound", sound: index, volume }),
        ),
      );
    }
    const what = this.model.of(thing);
    if (what && "pushable" in what)
      this.box.append(
        make("p", { className: "hint", textContent: what.pushable ? "Robots can push it." : "It stands fast." }),
      );
  }

  /** Put the newest numbers in. */
  renew() {
    if (!this.thing || !this.model.frame) return;
    const [x, y, angle] = this.model.pose(this.thing),
      turned = degrees(angle);
    this.say("x", `${x.toFixed(3)} m`);
    this.say("y", `${y.toFixed(3)} m`);
    this.say("angle", `${turned}°`);
    const what = this.model.of(this.thing);
    if (what && "intensity" in what) this.set("intensity", what.intensity);
    if (what && "volume" in what) this.set("volume", what.volume);
    if (this.thing.kind === "robot") this.renewRobot(this.thing.index, this.model.frame, turned);
  }

  /** @param {number} index @param {Frame} frame @param {number} turned */
  renewRobot(index, frame, turned) {
    const { readings, speeds } = this.model;
    this.say("heading", `${turned}°`);
    this.say("speed", `${(100 * speeds[2 * index]).toFixed(1).replace("-0.0", "0.0")} cm/s`);
    this.say("turning", `${((speeds[2 * index + 1] * 180) / Math.PI).toFixed(0).replace(/^-0$/, "0")} °/s`);
    this.say("contact", frame.bits[index] & 1 ? "yes" : "no");
    if (!readings || readings.robot !== index) return;
    this.say("wheel steps", readings.encoders.join(" / "));
    readings.proximity.forEach((value, k) => {
      this.bars[k][0].style.width = `${Math.min(100, value / 40.95)}%`;
      this.bars[k][1].textContent = String(value);
    });
    if (this.link && !this.isHeld(this.link)) this.link.checked = !readings.link.cut;
    for (const [key] of KNOBS) this.set(key, readings.link[key]);
  }

  /** @param {string} name @param {string} text */
  say(name, text) {
    const part = this.parts[name];
    if (part && part.textContent !== text) part.textContent = text;
  }

  /**
   * Let a control show what was asked for until news from after the answer are here: older ones would turn it back.
   * @param {HTMLElement} control
   * @param {Answer} answer
   */
  async hold(control, answer) {
    const held = this.held;
    held.set(control, Infinity);
    if ((await answer) === null) return; // one of its kind is under way, which ends this, too
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
    knob[1].textContent = knob[2](value);
  }
}
