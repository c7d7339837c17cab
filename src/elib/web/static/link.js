// How the link is: round trips, losses, what waits.

import { age, make, number, say } from "./dom.js";

/** @import { Known, LinkStats } from "./hub.js" */

/** @type {(seconds: number | null) => string} */
const ms = (seconds) => (seconds === null ? "?" : `${number(1000 * seconds, seconds < 0.01 ? 1 : 0)} ms`);
/** @type {[title: string, text: (link: LinkStats) => string][]} */
const ROWS = [
  ["Round trip, median", (link) => ms(link.median)],
  ["Round trip, 99 %", (link) => ms(link.p99)],
  ["Answers lost", (link) => (link.loss === null ? "?" : `${number(100 * link.loss, 1)} % · ${link.lost}`)],
  ["Answers", (link) => String(link.count)],
  ["Waiting", (link) => `${link.waiting} calls`],
  ["Refused", (link) => String(link.refused)],
  ["Never sent", (link) => String(link.unsent)],
  ["Line out of sync", (link) => `${link.resyncs} times`],
  ["Restarts", (link) => String(link.resets)],
  ["Last answer", (link) => (link.age === null ? "?" : `${age(link.age)} ago`)],
];

export class Part {
  /** @param {HTMLElement} box */
  constructor(box) {
    this.firmware = make("dd", { textContent: "?" });
    this.values = ROWS.map(() => make("dd", { textContent: "?" }));
    box.append(
      make(
        "dl",
        {},
        make("dt", { textContent: "Firmware" }),
        this.firmware,
        ...ROWS.flatMap(([title], k) => [make("dt", { textContent: title }), this.values[k]]),
      ),
    );
    this.box = box;
  }

  /** @param {Known} robot */
  show({ tick, scheme }) {
    say(this.firmware, scheme?.firmware || "?");
    ROWS.forEach(([, text], k) => say(this.values[k], tick.link ? text(tick.link) : "?"));
    this.box.classList.toggle("stale", tick.phase !== "connected");
  }
}
