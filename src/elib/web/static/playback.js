// The time line of a recording that is played: hold it, let it go on, and go to any moment.

import { make, number, say } from "./dom.js";

/** @import { Remote } from "./dom.js" */
/** @import { Known } from "./hub.js" */

export class Part {
  /** @param {HTMLElement} box @param {Remote} robot */
  constructor(box, robot) {
    this.box = box;
    this.isPaused = false;
    this.button = make("button", { type: "button", className: "plain", textContent: "Hold" });
    this.button.addEventListener("click", () => robot.ask("pause_playback", { on: !this.isPaused }));
    this.line = make("input", { type: "range", min: 0, step: 0.1, "aria-label": "moment of the recording, seconds" });
    this.line.addEventListener("input", () => this.sayTime(this.line.valueAsNumber));
    this.line.addEventListener("change", () => robot.ask("seek", { seconds: this.line.valueAsNumber }));
    this.text = make("output");
    box.classList.add("playback", "row");
    box.append(this.button, this.line, this.text);
    box.hidden = true;
  }

  /** @param {number} seconds */
  sayTime(seconds) {
    say(this.text, `${number(seconds, 1)} of ${number(Number(this.line.max), 1)} s`);
  }

  /** @param {Known} robot */
  show({ tick }) {
    const { playback } = tick;
    this.box.hidden = !playback;
    if (!playback) return;
    this.isPaused = playback.paused;
    say(this.button, playback.paused ? "Play" : "Hold");
    this.line.max = String(playback.length);
    if (this.line.matches(":active")) return;
    this.line.value = String(playback.at);
    this.sayTime(playback.at);
  }
}
