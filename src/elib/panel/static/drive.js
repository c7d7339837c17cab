// Driving: pad, keys, gamepad and a slider for each wheel. While a hand is on any of them the page says so ten times a
// second, for a stick that is held still says nothing by itself; the server stops the robot when that ends.

import { button, confirmed, draw, isBusy, make, number, pleaseStop, put, say } from "./dom.js";

/** @import { Remote } from "./dom.js" */
/** @import { Known, Phase } from "./hub.js" */

/** @typedef {[left: number, right: number]} Wheels shares of the limit, -1 to 1 */

const PERIOD = 100; // ms between two messages
const QUICK = 40; // ms between two changes, at least
const LINGER = 5000; // ms that a page which drove goes on to say that it is there
const DEAD = 0.08; // share of the pad's radius that means nothing
const PAD_DEAD = 0.15; // of a gamepad's axis
const TURN = 0.5; // of a key that turns: at full speed nobody can aim
const HAS_KEYS = !matchMedia("(pointer: coarse), (max-width: 720px)").matches; // a phone has none
const ARROWS = "Arrow keys or a gamepad drive it, too.";
/** @type {Record<string, [x: number, y: number]>} */
const KEYS = {
  ArrowUp: [0, 1],
  KeyW: [0, 1],
  ArrowDown: [0, -1],
  KeyS: [0, -1],
  ArrowLeft: [-1, 0],
  KeyA: [-1, 0],
  ArrowRight: [1, 0],
  KeyD: [1, 0],
};

/**
 * Speeds of the wheels for a stick that points right by x and ahead by y.
 * @param {number} x
 * @param {number} y
 * @returns {Wheels}
 */
export function mixed(x, y) {
  const left = y + x,
    right = y - x,
    most = Math.max(1, Math.abs(left), Math.abs(right));
  return [left / most, right / most];
}

export class Part {
  /** @param {HTMLElement} box @param {Remote} robot */
  constructor(box, robot) {
    this.box = box;
    this.robot = robot;
    /** @type {[x: number, y: number] | null} */
    this.pad = null;
    /** @type {Set<string>} */
    this.keys = new Set();
    /** @type {Wheels} */
    this.wheels = [0, 0]; // of the sliders
    /**
     * How a gamepad was seen last: whether a stop button is pressed, and its stick was not let go since.
     * @type {{ index: number, stops: boolean, isLatched: boolean, stick: [x: number, y: number] | null } | null}
     */
    this.game = null;
    this.fastest = 1; // rev/s
    this.isAllowed = false;
    this.isMine = false;
    this.mayMove = false;
    this.isLimiting = -Infinity; // when the limit was moved last
    this.had = false; // a hand was on when something was sent last
    this.sent = 0;
    this.handOff = -Infinity;
    box.classList.add("stick");
    /** @type {HTMLInputElement[]} */
    this.inputs = []; // a slider for each wheel
    /** @type {(r: number, kind: string) => SVGElement} */
    const ring = (r, kind) => draw("circle", { r, class: kind });
    /** @type {(turn: number) => SVGElement} */
    const arrow = (turn) => draw("path", { d: "M-8,-84 L0,-93 L8,-84", class: "arrow", transform: `rotate(${turn})` });
    this.knob = draw("circle", { r: 24, class: "knob" });
    this.echo = draw("circle", { r: 7, class: "echo" });
    this.face = draw(
      "svg",
      { viewBox: "-105 -105 210 210", "aria-hidden": "true" },
      ring(100, "rim"),
      ring(60, "line"),
      ring(8, "line"),
      draw("path", { d: "M-78,0H78M0,-78V78", class: "line" }),
      ...[0, 90, 180, 270].map(arrow),
      this.knob,
      this.echo,
    );
    this.field = make(
      "div",
      {
        className: "pad",
        tabIndex: 0,
        role: "application",
        "aria-label": "driving pad; arrow keys or W A S D drive, space stops",
        "aria-describedby": "stick-help",
      },
      this.face,
    );
    this.field.addEventListener("pointerdown", (event) => {
      this.field.setPointerCapture(event.pointerId);
      this.pull(event);
    });
    this.field.addEventListener("pointermove", (event) => {
      if (this.pad) this.pull(event);
    });
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"])
      this.field.addEventListener(name, () => {
        this.pad = null;
        this.change();
      });
    this.state = make("p", { className: "driver", role: "status" });
    this.takeOver = button("Take over …", () => this.askToTakeOver(), { hidden: true });
    const sliders = ["left", "right"].map((side, wheel) => this.slider(side, wheel));
    this.hold = make("input", { type: "checkbox" });
    this.limit = make("input", {
      type: "range",
      min: 5,
      max: 100,
      step: 5,
      value: 50,
      "aria-label": "speed limit, percent of the fastest",
      title: "It holds for the pad, the keys and the gamepad. Behaviours drive as fast as they want.",
    });
    this.limitText = make("output");
    this.limit.addEventListener("input", () => {
      this.isLimiting = performance.now();
      this.robot.tell("limit", { share: this.limit.valueAsNumber / 100 });
      this.sayLimit(this.limit.valueAsNumber / 100);
    });
    this.keysHint = make("p", { className: "hint keys", id: "stick-help", textContent: ARROWS });
    this.speeds = make("p", { className: "speeds" }, make("span"), make("span"));
    this.gamepad = make("p", { className: "hint" });
    this.box.replaceChildren(
      make("div", { className: "handles" }, sliders[0], this.field, sliders[1]),
      this.speeds,
      make("label", { className: "slider" }, "Your speed limit", this.limitText, this.limit),
      make("div", { className: "who" }, this.state, this.takeOver),
      make(
        "div",
        { className: "more" },
        make("label", { className: "check" }, this.hold, "Sliders stay where I put them"),
        this.keysHint,
        this.gamepad,
      ),
    );
    this.paint();
    this.timer = setInterval(() => this.beat(), PERIOD);
    this.open = new AbortController(); // ends what is listened to
    /** @type {(target: EventTarget, name: string, act: (event: any) => void) => void} */
    const listen = (target, name, act) => target.addEventListener(name, act, { signal: this.open.signal });
    listen(window, "keydown", (event) => this.press(event));
    listen(window, "keyup", (event) => {
      if (this.keys.delete(event.code)) this.change();
    });
    listen(window, "blur", () => this.leave());
    listen(window, "pagehide", () => this.leave());
    listen(document, "visibilitychange", () => {
      if (document.hidden) this.leave();
    });
    listen(window, "elib-stop", () => this.letGo());
    listen(window, "elib-arrows", ({ detail }) =>
      say(this.keysHint, detail ? `Arrow keys move ${detail} now. W\u00a0A\u00a0S\u00a0D drive.` : ARROWS),
    );
    listen(window, "elib-drives", () => {
      this.handOff = performance.now();
      this.isMine = true;
    });
  }

  close() {
    clearInterval(this.timer);
    this.leave();
    this.open.abort();
  }

  /** @param {string} side @param {number} wheel */
  slider(side, wheel) {
    const input = make("input", {
      type: "range",
      min: -100,
      max: 100,
      step: 5,
      value: 0,
      "aria-label": `${side} wheel, percent of the limit`,
    });
    input.addEventListener("input", () => {
      this.wheels[wheel] = input.valueAsNumber / 100;
      this.change();
    });
    const spring = () => {
      if (!this.hold.checked) {
        input.value = "0";
        this.wheels[wheel] = 0;
        this.change();
      }
    };
    for (const name of ["pointerup", "pointercancel", "blur"]) input.addEventListener(name, spring);
    this.inputs.push(input);
    return make("label", { className: "wheel" }, make("span", { textContent: side }), input);
  }

  // What the hands want

  /** @param {PointerEvent} event */
  pull(event) {
    const { left, top, width } = this.field.getBoundingClientRect(),
      reach = (width / 2) * (78 / 105);
    const x = (event.clientX - left - width / 2) / reach,
      y = -(event.clientY - top - width / 2) / reach;
    const far = Math.hypot(x, y),
      scale = far > 1 ? 1 / far : far < DEAD ? 0 : 1;
    this.pad = [x * scale, y * scale];
    this.change();
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || !(event.code in KEYS) || !this.isAllowed) return;
    if (isBusy(event.target, event.code.startsWith("Arrow"))) return;
    event.preventDefault();
    if (event.repeat || this.keys.has(event.code)) return; // one that was held when stop came is none
    this.keys.add(event.code);
    this.change();
  }

  readGamepad() {
    const pads = [...(navigator.getGamepads?.() ?? [])].flatMap((pad) => (pad?.connected ? [pad] : []));
    const pad = pads.find((each) => each.index === this.game?.index) ?? pads[0];
    if (!pad) {
      if (this.game) {
        this.game = null;
        say(this.gamepad, "Gamepad: gone.");
      }
      return;
    }
    const [x, y] = [pad.axes[0] ?? 0, -(pad.axes[1] ?? 0)],
      far = Math.hypot(x, y);
    const stops = Boolean(pad.buttons[0]?.pressed || pad.buttons[1]?.pressed);
    if (!this.game)
      say(this.gamepad, `Gamepad: ${pad.id.slice(0, 60)}. Left stick drives, its first two buttons stop.`);
    if (stops && !this.game?.stops) pleaseStop();
    const isCentred = far < PAD_DEAD,
      isLatched = !isCentred && (stops || Boolean(this.game?.isLatched)); // after a stop it has to be let go
    this.game = {
      index: pad.index,
      stops,
      isLatched,
      stick: isCentred || isLatched ? null : far > 1 ? [x / far, y / far] : [x, y],
    };
  }

  /**
   * What the hand that is on wants, or null.
   * @returns {Wheels | null}
   */
  hand() {
    if (this.pad) return mixed(...this.pad);
    if (this.keys.size) {
      let [x, y] = [0, 0];
      for (const code of this.keys) [x, y] = [x + KEYS[code][0], y + KEYS[code][1]];
      return mixed(Math.sign(x) * TURN, Math.sign(y));
    }
    if (this.game?.stick) return mixed(...this.game.stick);
    return this.wheels[0] || this.wheels[1] ? this.wheels : null;
  }

  // What is sent

  change() {
    this.paint();
    if (performance.now() - this.sent >= QUICK || !this.hand()) this.send();
  }

  beat() {
    this.readGamepad();
    if (this.hand() || this.had) {
      this.paint();
      this.send();
    } else if (this.isMine && !document.hidden && (this.mayMove || performance.now() - this.handOff < LINGER))
      this.robot.tell("beat", {});
  }

  send() {
    const hand = this.isAllowed ? this.hand() : null;
    if (!hand && !this.had) return;
    const [left, right] = hand ?? [0, 0];
    this.sent = performance.now();
    if (!hand) this.handOff = this.sent;
    else if (!this.had) this.robot.tell("steer", { left: 0, right: 0 }); // a fresh hand: whatever was held at a stop is let go
    this.had = hand !== null;
    this.robot.tell("steer", { left, right });
  }

  /** Forget every hand that is on. */
  letGo() {
    this.pad = null;
    this.keys.clear();
    this.wheels = [0, 0];
    for (const input of this.inputs) input.value = "0";
    this.had = false;
    if (this.game?.stick) this.game = { ...this.game, stick: null, isLatched: true };
    this.paint();
  }

  leave() {
    const wasMine = this.had || this.isMine;
    this.letGo();
    this.handOff = -Infinity;
    if (wasMine) this.robot.tell("leave", {});
  }

  async askToTakeOver() {
    const wants = await confirmed(
      "Take over?",
      "Another browser drives this robot. The robot stops first. Then you drive, and the other person watches.",
      "Take over",
    );
    if (wants) await this.robot.ask("take_over");
  }

  // What is seen

  /** @param {Known} robot */
  show({ tick, scheme, behaviour }) {
    const { drive } = tick;
    this.fastest = scheme?.fastest ?? 1;
    this.isAllowed = tick.phase === "connected" || tick.phase === "gap";
    const isMine = drive.driver === this.robot.page(),
      isOther = drive.driver !== "" && !isMine;
    if (isMine && !this.isMine) this.handOff = performance.now(); // it took over: time to reach for the stick
    if (isOther && (this.isMine || this.had)) this.letGo(); // somebody took over: a hand that is still on drives no more
    this.isMine = isMine;
    this.mayMove = drive.may_move;
    this.box.dataset.off = this.isAllowed ? "no" : "yes";
    for (const control of [...this.inputs, this.hold, this.limit]) control.disabled = !this.isAllowed;
    say(this.state, this.whoDrives(tick.phase, isOther, behaviour?.phase === "running" ? behaviour.name : ""));
    this.takeOver.hidden = !isOther || !this.isAllowed;
    if (performance.now() - this.isLimiting > 1000) {
      this.limit.value = String(Math.round(drive.limit * 100));
      this.sayLimit(drive.limit);
    }
    const rim = 100 * (scheme?.circumference ?? 0); // cm that a wheel rolls in one turn
    /** @type {(speed: number) => string} */
    const both = (speed) => `${number(speed, 2)} rev/s, ${number(speed * rim, 1)} cm/s`;
    say(this.speeds.children[0], both(drive.left));
    say(this.speeds.children[1], both(drive.right));
    // Where the knob stands, if a hand drives; otherwise a share of the fastest.
    const scale = Math.max(1e-6, (isMine ? drive.limit : 1) * this.fastest),
      left = drive.left / scale,
      right = drive.right / scale;
    put(this.echo, "cx", (39 * (left - right)) | 0);
    put(this.echo, "cy", (-39 * (left + right)) | 0);
    this.echo.classList.toggle("still", !left && !right);
  }

  /** @param {Phase} phase @param {boolean} isOther @param {string} behaviour the one that runs */
  whoDrives(phase, isOther, behaviour) {
    if (phase === "playing") return "A recording cannot be driven.";
    if (!this.isAllowed) return "Connect the robot to drive it.";
    if (isOther) return "Another browser drives this robot.";
    if (this.isMine) return "You drive.";
    if (behaviour) return `${behaviour} drives. Touch the pad to pause it.`;
    if (this.mayMove) return "The robot is moving.";
    return HAS_KEYS ? "To drive, use the pad or W\u00a0A\u00a0S\u00a0D." : "To drive, use the pad.";
  }

  /** @param {number} share */
  sayLimit(share) {
    say(this.limitText, `${Math.round(100 * share)} % · ${number(share * this.fastest, 2)} rev/s`);
  }

  paint() {
    const hand = this.hand();
    const [x, y] = this.pad ?? (hand ? [(hand[0] - hand[1]) / 2, (hand[0] + hand[1]) / 2] : [0, 0]);
    put(this.knob, "cx", 78 * x);
    put(this.knob, "cy", -78 * y);
    this.field.classList.toggle("on", hand !== null);
  }
}
