// What a person drives with: pad, keys, gamepad, and a slider for each wheel. While a hand is on any of them the page
// says so ten times a second, for a stick that is held still says nothing by itself; the server stops the robot when
// that ends.
import { effect, signal, untracked } from "@preact/signals";
import { isBusy } from "../look/keys";
import type { Tick } from "../messages";
import { stop, stops } from "../stop";
import { hello, worldOf, type Robot } from "../store";

export type Wheels = [left: number, right: number]; // shares of the limit, -1 to 1
export type Stick = [right: number, ahead: number];

const PERIOD = 100; // ms between two messages
const QUICK = 40; // ms between two changes, at least
const LINGER = 5000; // ms that a page which drove goes on to say that it is there
const DEAD = 0.08; // share of the pad's radius that means nothing
const GAMEPAD_DEAD = 0.15; // of a gamepad's axis
const TURN = 0.5; // of a key that turns, or a cross: at full speed nobody can aim
const KEYS: Record<string, Stick> = {
  ArrowUp: [0, 1],
  KeyW: [0, 1],
  ArrowDown: [0, -1],
  KeyS: [0, -1],
  ArrowLeft: [-1, 0],
  KeyA: [-1, 0],
  ArrowRight: [1, 0],
  KeyD: [1, 0],
};

let open: Hands | null = null;

/** A command was typed that may move the robot: this page is then the one that drives it. */
export const noteTyped = () => open?.drives();

export const mayDrive = (tick: Tick | null) => tick?.phase === "connected" || tick?.phase === "gap";

/** Speeds of the wheels for a stick. */
function mixed([x, y]: Stick): Wheels {
  const left = y + x,
    right = y - x,
    most = Math.max(1, Math.abs(left), Math.abs(right));
  return [left / most, right / most];
}

export class Hands {
  /** Where the knob stands, or null while no hand is on. */
  readonly knob = signal<Stick | null>(null);
  readonly sliders = signal<Wheels>([0, 0]);
  readonly gamepad = signal("");
  private pad: Stick | null = null;
  private keys = new Set<string>();
  private game: { index: number; stops: boolean; isLatched: boolean; stick: Stick | null } | null = null;
  private isMine = false;
  private had = false; // a hand was on when something was sent last
  private sent = 0;
  private handOff = -Infinity;

  constructor(private robot: Robot) {}

  /** Listen to the person until the function that is returned is called. */
  open() {
    open = this;
    const ended = new AbortController(),
      leave = () => this.leave(),
      listen = <E extends Event>(target: EventTarget, name: string, act: (event: E) => void) =>
        target.addEventListener(name, act as EventListener, { signal: ended.signal });
    listen<KeyboardEvent>(window, "keydown", (event) => this.press(event));
    listen<KeyboardEvent>(window, "keyup", ({ code }) => this.keys.delete(code) && this.change());
    listen(window, "blur", leave);
    listen(window, "pagehide", leave);
    listen(document, "visibilitychange", () => document.hidden && this.leave());
    const timer = setInterval(() => this.beat(), PERIOD);
    const ends = [
      effect(() => (stops.value, untracked(() => this.letGo()))),
      effect(() => (this.robot.tick.value, untracked(() => this.follow()))),
    ];
    return () => {
      clearInterval(timer);
      this.leave();
      for (const end of ends) end();
      ended.abort();
      if (open === this) open = null;
    };
  }

  // -- what the hands want --

  /** Push the pad's stick, or let it go. */
  push(stick: Stick | null) {
    const far = stick ? Math.hypot(...stick) : 0,
      scale = far > 1 ? 1 / far : far < DEAD ? 0 : 1;
    this.pad = stick && [stick[0] * scale, stick[1] * scale];
    this.change();
  }

  get isHeld() {
    return this.pad !== null;
  }

  slide(wheels: Wheels) {
    this.sliders.value = wheels;
    this.change();
  }

  private press(event: KeyboardEvent) {
    const { code, target } = event;
    if (event.ctrlKey || event.metaKey || event.altKey || !(code in KEYS) || !mayDrive(this.robot.tick.peek())) return;
    if (isBusy(target, code.startsWith("Arrow"))) return;
    event.preventDefault();
    if (event.repeat || this.keys.has(code)) return; // one that was held when stop came is none
    this.keys.add(code);
    this.change();
  }

  private readGamepad() {
    const pads = [...(navigator.getGamepads?.() ?? [])].flatMap((each) => (each?.connected ? [each] : [])),
      pad = pads.find(({ index }) => index === this.game?.index) ?? pads[0];
    if (!pad) {
      if (this.game) this.gamepad.value = "Gamepad: gone.";
      this.game = null;
      return;
    }
    const hasCross = pad.mapping === "standard",
      isOn = (button: number) => Number(Boolean(hasCross && pad.buttons[button]?.pressed)),
      stick: Stick = [(pad.axes[0] ?? 0) + TURN * (isOn(15) - isOn(14)), isOn(12) - isOn(13) - (pad.axes[1] ?? 0)],
      far = Math.hypot(...stick),
      isCentred = far < GAMEPAD_DEAD,
      isStop = Boolean(pad.buttons[0]?.pressed || pad.buttons[1]?.pressed);
    this.gamepad.value = `Gamepad: ${pad.id.slice(0, 60)}. Left stick drives, its first two buttons stop.`;
    if (isStop && !this.game?.stops) stop();
    const isLatched = !isCentred && (isStop || Boolean(this.game?.isLatched)); // after a stop it has to be let go
    this.game = {
      index: pad.index,
      stops: isStop,
      isLatched,
      stick: isCentred || isLatched ? null : far > 1 ? [stick[0] / far, stick[1] / far] : stick,
    };
  }

  /** What the hand that is on wants, or null. */
  private hand(): Wheels | null {
    if (this.pad) return mixed(this.pad);
    if (this.keys.size) {
      let [x, y] = [0, 0];
      for (const code of this.keys) [x, y] = [x + KEYS[code][0], y + KEYS[code][1]];
      return mixed([Math.sign(x) * TURN, Math.sign(y)]);
    }
    if (this.game?.stick) return mixed(this.game.stick);
    const wheels = this.sliders.peek();
    return wheels[0] || wheels[1] ? wheels : null;
  }

  // -- what is sent --

  private change() {
    this.show();
    if (performance.now() - this.sent >= QUICK || !this.hand()) this.send();
  }

  private beat() {
    this.readGamepad();
    const isNear = this.robot.tick.peek()?.drive.may_move || performance.now() - this.handOff < LINGER;
    if (this.hand() || this.had) {
      this.show();
      this.send();
    } else if (this.isMine && !document.hidden && isNear) this.robot.tell("beat", {});
  }

  private send() {
    const hand = mayDrive(this.robot.tick.peek()) ? this.hand() : null;
    if (!hand && !this.had) return;
    const [left, right] = hand ?? [0, 0];
    this.sent = performance.now();
    if (!hand) this.handOff = this.sent;
    else if (!this.had) {
      this.robot.tell("steer", { left: 0, right: 0 }); // a fresh hand: what was held at a stop is let go
      worldOf().lookAt(null); // who drives sees where
    }
    this.had = hand !== null;
    this.robot.tell("steer", { left, right });
  }

  /** Forget every hand that is on. */
  private letGo() {
    this.pad = null;
    this.keys.clear();
    this.sliders.value = [0, 0];
    this.had = false;
    if (this.game?.stick) this.game = { ...this.game, stick: null, isLatched: true };
    this.show();
  }

  private leave() {
    const wasMine = this.had || this.isMine;
    this.letGo();
    this.handOff = -Infinity;
    if (wasMine) this.robot.tell("leave", {});
  }

  /** This page is the one that drives: it goes on to say that it is there. */
  drives() {
    this.isMine = true;
    this.handOff = performance.now();
  }

  private follow() {
    const driver = this.robot.tick.peek()?.drive.driver ?? "",
      isMine = driver !== "" && driver === hello.peek()?.page;
    if (isMine && !this.isMine) this.drives(); // it took over: time to reach for the stick
    if (driver && !isMine && (this.isMine || this.had)) this.letGo(); // another took over: a hand that is still on is none
    this.isMine = isMine;
  }

  private show() {
    const hand = this.hand();
    this.knob.value = this.pad ?? (hand && [(hand[0] - hand[1]) / 2, (hand[0] + hand[1]) / 2]);
  }
}
