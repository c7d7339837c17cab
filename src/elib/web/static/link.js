// How good the link is: how long answers take, and what was lost.

import { age, make, number, say } from "./dom.js";

/** @import { Known, LinkStats } from "./hub.js" */

/** @type {(seconds: number | null) => string} */
const ms = (seconds) => (seconds === null ? "?" : `${number(1000 * seconds, seconds < 0.01 ? 1 : 0)} ms`);
/** @type {[title: string, text: (link: LinkStats) => string][]} */
const ROWS = [
  ["Time to an answer, usually", (link) => ms(link.median)],
  ["Time to an answer, 99 of 100", (link) => ms(link.p99)],
  [
    "Commands without an answer",
    (link) => (link.loss === null ? "?" : `${link.lost} (${number(100 * link.loss, 1)} %)`),
  ],
  ["Answers received", (link) => String(link.count)],
  ["Commands that wait", (link) => String(link.waiting)],
  ["Commands that the robot did not know", (link) => String(link.refused)],
  ["Commands given up before they were sent", (link) => String(link.unsent)],
  ["Order of answers restored", (link) => `${link.resyncs} times`],
  ["Restarts of the robot", (link) => String(link.resets)],
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
