// What the page knows of the robots and their world: it takes the updates of the server, and every part that shows a
// robot or the world is told. One update a tick: nothing is asked for, and nothing is sent for each value.

const KEPT_LINES = 500,
  KEPT_POINTS = 5000;
const KEPT_TICKS = 3000; // five minutes at ten a second
const SILENCE = 1.5; // s without a message after which the page says that what it shows is old

// What the server says. elib/panel/server/instruments.py describes every field of a scheme, a tick and a summary, with its unit.

/**
 * @typedef {"disconnected" | "connecting" | "connected" | "gap" | "playing" | "failed"} Phase
 * @typedef {{ name: string, state: "ok" | "warning" | "failed" | "skipped", detail: string, fix: string }} Step
 * @typedef {[x: number, y: number, heading: number]} Pose m and rad
 * @typedef {{ number: number, time: number, kind: string, text: string, bad: boolean }} Line of the event log
 * @typedef {{ ring: number[], body: number, front: number, rgb: number[][] | null }} Lamps
 *
 * @typedef {{
 *   name: string, title: string, labels: string[], units: string[], physical_unit: string,
 *   low: number | null, high: number | null, absent: string,
 * }} Instrument
 * @typedef {{
 *   scheme: number, firmware: string, fastest: number, circumference: number, status_led: number | null,
 *   instruments: Instrument[],
 * }} Scheme what seldom changes
 *
 * @typedef {{
 *   driver: string, left: number, right: number, limit: number, may_move: boolean, trouble: string,
 * }} Drive
 * @typedef {{
 *   values: (number | boolean | null)[] | null, physical: (number | null)[] | null,
 *   age: number | null, stale: boolean,
 * }} Reading
 * @typedef {{
 *   width: number, height: number, mode: "GREY" | "COLOUR", age: number, stale: boolean, pixels: string | null,
 * }} Picture
 * @typedef {{
 *   median: number | null, p99: number | null, count: number, lost: number, refused: number, unsent: number,
 *   resyncs: number, resets: number, loss: number | null, age: number | null, waiting: number,
 * }} LinkStats
 * @typedef {{
 *   time: number, phase: Phase, phase_text: string, error: { message: string, hint: string } | null,
 *   doctor: { steps: Step[] } | null, drive: Drive, readings: Record<string, Reading | undefined>, lamps: Lamps,
 *   distances: (number | null)[],
 *   camera: { width: number, height: number, zoom: number, mode: string } | null, picture: Picture | null,
 *   pose: Pose | null, trail: { whole: boolean, points: [x: number, y: number][] },
 *   lines: { whole: boolean, lines: Line[] }, link: LinkStats | null,
 *   playback: { at: number, length: number, paused: boolean } | null, live: number | null,
 *   log: string | null, recorder: { path: string, bytes: number, messages: number } | null,
 * }} Tick what changes
 *
 * @typedef {{
 *   url: string, phase: Phase, phase_text: string, error: string | null, may_move: boolean, driver: string,
 *   behaviour: string, distances: (number | null)[], battery: number | null, stale: boolean, median: number | null,
 * }} Summary of a robot in the overview
 * @typedef {{
 *   name: string, phase: "idle" | "running" | "paused" | "ended" | "stopped" | "failed", phase_text: string,
 *   state: string, reason: string, error: string, time: number, count: number, lines: [time: number, text: string][],
 * }} Play how a behaviour stands: elib/panel/behaviours.py describes it
 * @typedef {{
 *   number: number, place: string, robots?: { key: string, label: string, url: string }[],
 *   robot?: { tick: Tick, scheme?: Scheme, behaviour: Play }, overview?: Record<string, Summary>,
 *   worlds?: [robot: string, name: string][], study?: import("./study.js").News,
 * }} Update
 */

// What the page keeps.

/** @typedef {Robot & { tick: Tick }} Known a robot of which something was heard */

/**
 * A moment of a robot, for charts: s, and rev/s of the wheels as commanded.
 * @typedef {{
 *   time: number, values: Record<string, (number | null)[]>, latency: number | null, wheels: [number, number],
 * }} Point
 */

class Robot {
  /** @param {string} key */
  constructor(key) {
    this.key = key;
    /** @type {Scheme | null} */
    this.scheme = null;
    /** @type {Tick | null} */
    this.tick = null;
    /** @type {[x: number, y: number][]} */
    this.trail = [];
    /** @type {Line[]} */
    this.lines = [];
    /** @type {string | null} */
    this.pixels = null;
    /** @type {Point[]} */
    this.history = [];
    /** @type {Play | null} */
    this.behaviour = null;
  }

  /** @param {Tick} tick */
  take(tick) {
    this.tick = tick;
    const { trail, lines, picture } = tick;
    if (trail.whole) this.trail = [];
    if (trail.points.length) this.trail = this.trail.concat(trail.points).slice(-KEPT_POINTS);
    if (lines.whole) this.lines = [];
    if (lines.lines.length) this.lines = this.lines.concat(lines.lines).slice(-KEPT_LINES);
    if (!picture) this.pixels = null;
    else if (picture.pixels) this.pixels = picture.pixels;
    // Charts show only news: an old value is not a value of now.
    /** @type {Point["values"]} */
    const values = {};
    for (const [name, reading] of Object.entries(tick.readings)) {
      const found = reading?.physical ?? reading?.values;
      if (found && !reading?.stale) values[name] = found.map((each) => (each === null ? null : Number(each)));
    }
    const { left, right } = tick.drive;
    this.history.push({ time: tick.time, values, latency: tick.link?.median ?? null, wheels: [left, right] });
    if (this.history.length > KEPT_TICKS + 500) this.history.splice(0, 500);
  }
}

class Hub {
  constructor() {
    /** @type {Map<string, Robot>} */
    this.robots = new Map();
    /** @type {Map<string, Set<(news: any) => void>>} */
    this.listeners = new Map();
    /** @type {Record<string, unknown>} */
    this.news = {}; // the last of each channel
    this.last = Infinity; // before the first message the page is only opening
    this.isSilent = false;
    setInterval(() => this.watch(), 250);
  }

  /** @param {string} key */
  robot(key) {
    const robot = this.robots.get(key) ?? new Robot(key);
    this.robots.set(key, robot);
    return robot;
  }

  /** @param {Update} update */
  take(update) {
    this.last = performance.now();
    if (this.isSilent) this.mute(false);
    if (update.robot) {
      const robot = this.robot(update.place);
      if (update.robot.scheme) robot.scheme = update.robot.scheme;
      const play = update.robot.behaviour,
        old = robot.behaviour;
      const known = old && old.count <= play.count && old.name === play.name ? old.lines : [];
      robot.behaviour = { ...play, lines: known.concat(play.lines).slice(-KEPT_LINES) };
      robot.take(update.robot.tick);
      this.spread(update.place, robot);
    }
    if (update.worlds) this.spread("worlds", update.worlds);
    if (update.overview) this.spread("overview", update.overview);
    if (update.study) this.spread("study", update.study);
  }

  /** @param {string} key of a robot, or a channel @param {unknown} news */
  spread(key, news) {
    this.news[key] = news;
    for (const listener of this.listeners.get(key) ?? []) {
      try {
        listener(news);
      } catch (error) {
        console.error(error); // one broken part must not stop the others
      }
    }
  }

  /**
   * Call `listener` with the last news of a robot or a channel, and whenever there is more; returns how to end that.
   * @param {string} key
   * @param {(news: any) => void} listener
   */
  listen(key, listener) {
    const listeners = this.listeners.get(key) ?? new Set();
    this.listeners.set(key, listeners);
    listeners.add(listener);
    if (key in this.news) listener(this.news[key]);
    return () => listeners.delete(listener);
  }

  watch() {
    const isSilent = performance.now() - this.last > 1000 * SILENCE;
    if (isSilent !== this.isSilent) this.mute(isSilent);
  }

  /** @param {boolean} isSilent */
  mute(isSilent) {
    this.isSilent = isSilent;
    document.documentElement.dataset.silent = isSilent ? "yes" : "no";
  }
}

export const hub = new Hub();
Object.assign(window, { elib: hub }); // for tests, and for those who look under the bonnet
