// What the page knows of the robots and their world: it takes the updates of the server, and every part that shows a
// robot or the world is told. One update a tick: nothing is asked for, and nothing is sent for each value.

const KEPT_LINES = 500,
  KEPT_POINTS = 5000;
const KEPT_TICKS = 3000; // five minutes at ten a second
const SILENCE = 1.5; // s without a message after which the page says that what it shows is old

// What the server says of a robot, as elib/web/instruments.py describes it.

/**
 * What seldom changes.
 * @typedef {object} Scheme
 * @property {number} scheme its number
 * @property {string} firmware empty before it is connected
 * @property {number} fastest rev/s that a wheel can do
 * @property {number} circumference m that a wheel rolls in one turn
 * @property {Instrument[]} instruments
 */

/**
 * @typedef {object} Instrument
 * @property {string} name
 * @property {string} title
 * @property {string[]} labels
 * @property {string[]} units one for each label
 * @property {string} physical_unit of a reading's `physical`; empty where there is none
 * @property {number | null} low
 * @property {number | null} high
 * @property {string} absent why this firmware has none; empty where it has
 */

/**
 * What changes.
 * @typedef {object} Tick
 * @property {number} time s on the server's clock
 * @property {Phase} phase
 * @property {string} phase_text
 * @property {{ message: string, hint: string } | null} error
 * @property {{ steps: Step[] } | null} doctor
 * @property {Drive} drive
 * @property {Record<string, Reading | undefined>} readings by the name of the instrument
 * @property {Lamps} lamps
 * @property {{ width: number, height: number, zoom: number, mode: string } | null} camera as last set
 * @property {Picture | null} picture
 * @property {Pose | null} pose
 * @property {{ whole: boolean, points: [x: number, y: number][] }} trail whole: forget what was drawn before
 * @property {{ whole: boolean, lines: Line[] }} lines likewise
 * @property {LinkStats | null} link
 * @property {{ at: number, length: number, paused: boolean } | null} playback of a recording, s
 * @property {number | null} live s between two pictures
 * @property {string | null} log the file that is being written
 * @property {{ path: string, bytes: number, messages: number } | null} recorder
 */

/**
 * @typedef {"disconnected" | "connecting" | "connected" | "gap" | "playing" | "failed"} Phase
 * @typedef {{ name: string, state: "ok" | "warning" | "failed" | "skipped", detail: string, fix: string }} Step
 * @typedef {[x: number, y: number, heading: number]} Pose m and rad
 * @typedef {{ number: number, time: number, kind: string, text: string, bad: boolean }} Line of the event log
 * @typedef {{ ring: number[], body: number, front: number, rgb: number[][] | null }} Lamps
 */

/**
 * Who drives, and how.
 * @typedef {object} Drive
 * @property {string} driver the page that drives; empty while nobody does
 * @property {number} left rev/s
 * @property {number} right rev/s
 * @property {number} limit share of the fastest, 0 to 1
 * @property {boolean} may_move
 * @property {string} trouble why the last command was not confirmed
 */

/**
 * @typedef {object} Reading
 * @property {(number | boolean | null)[] | null} values null before the first
 * @property {(number | null)[] | null} physical the same in the instrument's physical unit
 * @property {number | null} age s
 * @property {boolean} stale
 */

/**
 * @typedef {object} Picture
 * @property {number} width
 * @property {number} height
 * @property {"GREY" | "COLOUR"} mode
 * @property {number} age s
 * @property {boolean} stale
 * @property {string | null} pixels base64 of rows from the top; null if they were sent before
 */

/**
 * @typedef {object} LinkStats
 * @property {number | null} median s
 * @property {number | null} p99 s
 * @property {number} count
 * @property {number} lost
 * @property {number} refused
 * @property {number} unsent
 * @property {number} resyncs
 * @property {number} resets
 * @property {number | null} loss share of what was sent
 * @property {number | null} age s since the last answer
 * @property {number} waiting
 */

// What the server says on the channels, which belong to no robot.

/**
 * @typedef {object} Summary of a robot in the overview
 * @property {string} name
 * @property {string} url
 * @property {Phase} phase
 * @property {string} phase_text
 * @property {string | null} error
 * @property {boolean} may_move
 * @property {string} driver
 * @property {string} behaviour the one that runs; empty if none does
 * @property {Pose | null} pose
 * @property {number[] | null} proximity
 * @property {number | null} battery 0 to 1
 * @property {boolean} stale
 * @property {number | null} median s
 */

/**
 * @typedef {object} Play how a behaviour stands
 * @property {string} name
 * @property {"idle" | "running" | "paused" | "ended" | "stopped" | "failed"} phase
 * @property {string} phase_text
 * @property {string} state
 * @property {string} reason
 * @property {string} error
 * @property {number} time s
 * @property {number} count lines that there ever were
 * @property {[time: number, text: string][]} lines
 */

/**
 * @typedef {object} Update
 * @property {number} number
 * @property {string} place
 * @property {{ key: string, label: string, url: string }[]} [robots]
 * @property {{ tick: Tick, scheme?: Scheme, behaviour: Play }} [robot]
 * @property {Record<string, Summary>} [overview]
 */

// What the page keeps.

/** @typedef {Robot & { tick: Tick }} Known a robot of which something was heard */

/**
 * A moment of a robot, for charts.
 * @typedef {object} Point
 * @property {number} time s
 * @property {Record<string, (number | null)[]>} values
 * @property {number | null} latency s
 * @property {[left: number, right: number]} wheels rev/s
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
    if (tick.trail)
      this.trail = tail(tick.trail.whole ? tick.trail.points : this.trail.concat(tick.trail.points), KEPT_POINTS);
    if (tick.lines)
      this.lines = tail(tick.lines.whole ? tick.lines.lines : this.lines.concat(tick.lines.lines), KEPT_LINES);
    if (!tick.picture) this.pixels = null;
    else if (tick.picture.pixels) this.pixels = tick.picture.pixels;
    this.keep(tick);
  }

  /**
   * Remember what charts can show: only news, for an old value is not a value of now.
   * @param {Tick} tick
   */
  keep(tick) {
    /** @type {Point["values"]} */
    const values = {};
    for (const [name, reading] of Object.entries(tick.readings)) {
      if (reading && !reading.stale && reading.values)
        values[name] = (reading.physical ?? reading.values).map((/** @type {number | boolean | null} */ each) =>
          typeof each === "boolean" ? Number(each) : each,
        );
    }
    this.history.push({
      time: tick.time,
      values,
      latency: tick.link?.median ?? null,
      wheels: [tick.drive.left, tick.drive.right],
    });
    if (this.history.length > KEPT_TICKS + 500) this.history.splice(0, 500);
  }
}

/** @template T @param {T[]} list @param {number} most */
function tail(list, most) {
  return list.length > most ? list.slice(-most) : list;
}

/**
 * How a behaviour stands, with all lines that it wrote.
 * @param {Play | null} old
 * @param {Play} play
 */
function joined(old, play) {
  const known = old && old.count <= play.count && old.name === play.name ? old.lines : [];
  return { ...play, lines: tail(known.concat(play.lines), KEPT_LINES) };
}

class Hub {
  constructor() {
    /** @type {Map<string, Robot>} */
    this.robots = new Map();
    /** @type {Map<string, Set<(news: any) => void>>} */
    this.listeners = new Map();
    /** @type {Record<string, unknown>} */
    this.news = {}; // the last of each channel
    this.last = performance.now();
    this.isSilent = false;
    setInterval(() => this.watch(), 250);
  }

  /** @param {string} key */
  robot(key) {
    const robot = this.robots.get(key) ?? new Robot(key);
    this.robots.set(key, robot);
    return robot;
  }

  /**
   * Take an update of the server.
   * @param {Update} update
   */
  take(update) {
    this.last = performance.now();
    if (this.isSilent) this.mute(false);
    if (update.robot) {
      const robot = this.robot(update.place);
      if (update.robot.scheme) robot.scheme = update.robot.scheme;
      robot.behaviour = joined(robot.behaviour, update.robot.behaviour);
      robot.take(update.robot.tick);
      this.spread(update.place, robot);
    }
    if (update.overview) this.spread("overview", update.overview);
  }

  /**
   * Tell every part that listens to a robot, by its key, or to a channel.
   * @param {string} key
   * @param {unknown} news
   */
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
