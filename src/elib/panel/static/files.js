// The files of one robot: a log, a recording of everything, and recordings of the folder that can be played.

import { button, bytes, make, say } from "./dom.js";

/** @import { App } from "./app.js" */
/** @import { Remote } from "./dom.js" */
/** @import { Known } from "./hub.js" */

/** @typedef {ReturnType<Part["row"]>} Row */

export class Part {
  /** @param {HTMLElement} box @param {Remote} robot @param {App} app */
  constructor(box, robot, app) {
    this.app = app;
    this.robot = robot;
    this.log = this.row("log", "Log", "One line for each call: what was asked, how it ended, and when.");
    this.recording = this.row(
      "recording",
      "Recording",
      "Everything: each byte, each reading, each event. It can be played here, repeated and compared.",
    );
    this.list = make("div", { className: "choices" });
    const folder = app.hello?.folder;
    box.classList.add("files");
    box.append(
      this.log.box,
      this.recording.box,
      make(
        "section",
        { className: "tile", "aria-label": "recordings" },
        make(
          "div",
          { className: "row wrap" },
          make("h3", { textContent: "Play a recording" }),
          button("Look again", () => this.look()),
        ),
        this.list,
      ),
      make("p", {
        className: "hint",
        textContent: `Files are written to the folder that the program was started in${folder ? `: ${folder}` : ""}.`,
      }),
    );
    this.look();
  }

  /** @param {"log" | "recording"} kind @param {string} title @param {string} text */
  row(kind, title, text) {
    const name = make("input", { type: "text", maxLength: 80, spellcheck: false, "aria-label": `file of the ${kind}` });
    const state = make("p", { className: "hint", role: "status" });
    const turn = button("Start", () => this.turn(row, kind), { className: "primary" });
    const box = make(
      "section",
      { className: "tile", "aria-label": title },
      make("h3", { textContent: title }),
      make("p", { className: "hint", textContent: text }),
      make("div", { className: "row" }, name, turn),
      state,
    );
    const row = { box, name, turn, state, isOn: false };
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
    /** @type {{ recordings: [name: string, time: number, bytes: number][], log: string, recording: string }} */
    const { recordings, log, recording } = answer.result;
    for (const [row, free] of /** @type {[Row, string][]} */ ([
      [this.log, log],
      [this.recording, recording],
    ]))
      if (!row.isOn && document.activeElement !== row.name) row.name.value = free;
    this.list.replaceChildren(
      ...recordings.map(([name, time, size]) => {
        const facts = `${new Date(1000 * time).toLocaleString([], { dateStyle: "medium", timeStyle: "short" })}, ${bytes(size)}`;
        return make(
          "div",
          {},
          button(name, () => this.play(name)),
          make("p", { className: "hint", textContent: facts }),
        );
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
    const waits = tick.phase === "connected" || tick.phase === "gap" ? "" : "It begins when the robot is connected.";
    this.fill(this.log, tick.log !== null, waits || "The file is being written.");
    const size = tick.recorder ? `: ${bytes(tick.recorder.bytes)}` : "";
    this.fill(this.recording, tick.recorder !== null, waits || `The file is being written${size}.`);
  }

  /** @param {Row} row @param {boolean} isOn @param {string} words */
  fill(row, isOn, words) {
    row.isOn = row.name.disabled = isOn;
    say(row.turn, isOn ? "Stop" : "Start");
    say(row.state, isOn ? words : "");
  }
}
