// What the page knows of the robots: the server calls `elib.take` with a message, and every part that shows a robot
// hears of it. One message a tick: nothing is asked for, and nothing is sent for each value.

const KEPT_LINES = 500,
  KEPT_POINTS = 5000;
const KEPT_TICKS = 3000; // five minutes at ten a second
const CHANNELS = ["overview", "world", "play"]; // what is no robot's tick
const SILENCE = 1.5; // s without a message after which the page says that what it shows is old

class Robot {
  constructor(key) {
    Object.assign(this, { key, scheme: null, tick: null, trail: [], lines: [], pixels: null, history: [] });
  }

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

  /** Remember what charts can show: only news, for an old value is not a value of now. */
  keep(tick) {
    const values = {};
    for (const [name, reading] of Object.entries(tick.readings)) {
      if (!reading.stale && reading.values)
        values[name] = (reading.physical ?? reading.values).map((each) =>
          typeof each === "boolean" ? Number(each) : each,
        );
    }
    this.history.push({
      time: tick.time,
      values,
      latency: tick.link?.median ?? null,
      wheels: [tick.helm.left, tick.helm.right],
    });
    if (this.history.length > KEPT_TICKS + 500) this.history.splice(0, 500);
  }
}

function tail(list, most) {
  return list.length > most ? list.slice(-most) : list;
}

class Hub {
  constructor() {
    this.robots = new Map();
    this.listeners = new Map();
    this.news = {}; // the last of each channel
    this.last = performance.now();
    this.isSilent = false;
    this.emit = null; // set by the part that speaks to the server
    setInterval(() => this.watch(), 250);
  }

  robot(key) {
    if (!this.robots.has(key)) this.robots.set(key, new Robot(key));
    return this.robots.get(key);
  }

  /** Take a message of the server: {number, robots: {key: {scheme?, tick}}, overview?, world?, play?}. */
  take(message) {
    this.last = performance.now();
    if (this.isSilent) this.mute(false);
    for (const [key, news] of Object.entries(message.robots)) {
      const robot = this.robot(key);
      if (news.scheme) robot.scheme = news.scheme;
      if (news.tick) robot.take(news.tick);
      this.spread(key);
    }
    for (const channel of CHANNELS) {
      if (!message[channel]) continue;
      this.news[channel] = message[channel];
      this.spread(channel);
    }
    this.emit?.("drawn", message.number);
  }

  spread(key) {
    const what = this.news[key] ?? this.robots.get(key);
    for (const listener of this.listeners.get(key) ?? []) {
      try {
        listener(what);
      } catch (error) {
        console.error(error);
      } // one broken part must not stop the others
    }
  }

  /** Call `listener` with a robot whenever something is new of it; returns how to end that. */
  listen(key, listener) {
    if (!this.listeners.has(key)) this.listeners.set(key, new Set());
    this.listeners.get(key).add(listener);
    const known = this.robots.get(key);
    if (known?.tick) listener(known);
    return () => this.listeners.get(key).delete(listener);
  }

  watch() {
    const isSilent = performance.now() - this.last > 1000 * SILENCE;
    if (isSilent !== this.isSilent) this.mute(isSilent);
  }

  mute(isSilent) {
    this.isSilent = isSilent;
    document.documentElement.dataset.silent = isSilent ? "yes" : "no";
  }
}

export const hub = (window.elib ??= new Hub());
