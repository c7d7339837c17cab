// The time line of a recording that is played: pause it, let it go on, and go to any moment.

import { button, make, number, say } from "./dom.js";

/** @import { Remote } from "./dom.js" */
/** @import { Known } from "./hub.js" */

export class Part {
  /** @param {HTMLElement} box @param {Remote} robot */
  constructor(box, robot) {
    this.box = box;
    this.isPaused = false;
    this.button = button("Pause recording", () => robot.ask("pause_playback", { on: !this.isPaused }));
    this.line = make("input", {
      type: "range",
      min: 0,
      step: 0.1,
      "aria-label": "moment of the recording, seconds",
      oninput: () => this.sayTime(this.line.valueAsNumber),
      onchange: () => robot.ask("seek", { seconds: this.line.valueAsNumber }),
    });
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
  show({ tick: { playback } }) {
    this.box.hidden = !playback;
    if (!playback) return;
    this.isPaused = playback.paused;
    say(this.button, playback.paused ? "Go on" : "Pause recording");
    this.line.max = String(playback.length);
    if (this.line.matches(":active")) return;
    this.line.value = String(playback.at);
    this.sayTime(playback.at);
  }
}
