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

const FIRST = 4; // rows that are seen at once

/**
 * How good a link is, in a sentence.
 * @param {LinkStats} link
 */
function verdict({ median, loss, lost }) {
  if (median === null) return "No answer has come yet.";
  const isGood = median < 0.3 && (loss ?? 0) < 0.01;
  return `The link is ${isGood ? "good" : "poor"}: answers take ${ms(median)}, ${lost ? `${lost} were lost` : "nothing lost"}.`;
}

export class Part {
  /** @param {HTMLElement} box */
  constructor(box) {
    this.firmware = make("dd", { textContent: "?" });
    this.values = ROWS.map(() => make("dd", { textContent: "?" }));
    this.verdict = make("p", { textContent: "Not connected." });
    const rows = ROWS.map(([title], k) => [make("dt", { textContent: title }), this.values[k]]);
    box.append(
      this.verdict,
      make("dl", {}, make("dt", { textContent: "Firmware" }), this.firmware, ...rows.slice(0, FIRST).flat()),
      make("details", {}, make("summary", { textContent: "More" }), make("dl", {}, ...rows.slice(FIRST).flat())),
    );
    this.box = box;
  }

  /** @param {Known} robot */
  show({ tick, scheme }) {
    say(this.verdict, tick.link && tick.phase === "connected" ? verdict(tick.link) : "Not connected.");
    say(this.firmware, scheme?.firmware || "?");
    ROWS.forEach(([, text], k) => say(this.values[k], tick.link ? text(tick.link) : "?"));
    this.box.classList.toggle("stale", tick.phase !== "connected");
  }
}
