// The files of one robot: a log, a recording of everything, and recordings of the folder that can be played.

import { bytes, make, pending, say } from "./dom.js";

/** @import { App } from "./app.js" */
/** @import { Remote } from "./dom.js" */
/** @import { Known } from "./hub.js" */

/** @typedef {ReturnType<Part["row"]>} Row */

export class Part {
  /** @param {HTMLElement} box @param {Remote} robot @param {App} app */
  constructor(box, robot, app) {
    this.app = app;
    this.robot = robot;
    this.log = this.row("Log", "One line for each call: what was asked, how it ended, and when.", "log");
    this.recording = this.row(
      "Recording",
      "Everything: each byte, each reading, each event. It can be played here, repeated and compared.",
      "recording",
    );
    this.list = make("div", { className: "choices" });
    const again = make("button", { type: "button", className: "plain", textContent: "Look again" });
    again.addEventListener("click", () => pending(again, this.look()));
    const folder = app.hello?.folder;
    box.classList.add("files");
    box.append(
      this.log.box,
      this.recording.box,
      make(
        "section",
        { className: "tile", "aria-label": "recordings" },
        make("div", { className: "row wrap" }, make("h3", { textContent: "Play a recording" }), again),
        this.list,
      ),
      make("p", {
        className: "hint",
        textContent: `Files are written to the folder that the program was started in${folder ? `: ${folder}` : ""}.`,
      }),
    );
    this.look();
  }

  /** @param {string} title @param {string} text @param {"log" | "recording"} kind */
  row(title, text, kind) {
    const name = make("input", { type: "text", maxLength: 80, spellcheck: false, "aria-label": `file of the ${kind}` });
    const button = make("button", { type: "button", className: "primary", textContent: "Start" });
    const state = make("p", { className: "hint", role: "status" });
    const row = {
      box: make(
        "section",
        { className: "tile", "aria-label": title },
        make("h3", { textContent: title }),
        make("p", { className: "hint", textContent: text }),
        make("div", { className: "row" }, name, button),
        state,
      ),
      name,
      button,
      state,
      isOn: false,
    };
    button.addEventListener("click", () => pending(button, this.turn(row, kind)));
    return row;
  }

  /** @param {Row} row @param {"log" | "recording"} kind */
  async turn(row, kind) {
    if (row.isOn) await this.robot.ask(`stop_${kind}`);
    else await this.robot.ask(`start_${kind}`, { name: row.name.value });
    await this.look();
  }

  /** Look into the folder: which recordings it has, and which names are free. */
  async look() {
    const answer = await this.app.ask("files");
    if (!answer.ok) return;
    const { recordings, log, recording } = answer.result;
    if (!this.log.isOn && document.activeElement !== this.log.name) this.log.name.value = log;
    if (!this.recording.isOn && document.activeElement !== this.recording.name) this.recording.name.value = recording;
    this.list.replaceChildren(
      ...recordings.map((/** @type {string} */ name) => {
        const button = make("button", { type: "button", className: "plain", textContent: name });
        button.addEventListener("click", () => pending(button, this.play(name)));
        return button;
      }),
    );
    if (!recordings.length)
      this.list.append(make("p", { className: "hint", textContent: "There is no recording in the folder yet." }));
  }

  /** @param {string} name */
  async play(name) {
    const answer = await this.app.ask("open_recording", { name });
    if (answer.ok) await this.app.open(answer.result[0]);
  }

  /** @param {Known} robot */
  show({ tick }) {
    const waits = tick.phase === "connected" || tick.phase === "gap" ? "" : " as soon as the robot is connected";
    this.fill(this.log, tick.log !== null, waits || "is being written");
    const size = tick.recorder ? `is being written, ${bytes(tick.recorder.bytes)}` : "";
    this.fill(this.recording, tick.recorder !== null, waits || size);
  }

  /** @param {Row} row @param {boolean} isOn @param {string} words */
  fill(row, isOn, words) {
    row.isOn = isOn;
    say(row.button, isOn ? "Stop" : "Start");
    row.name.disabled = isOn;
    say(row.state, isOn ? (words.startsWith(" ") ? `It begins${words}.` : `The file ${words}.`) : "");
  }
}
