// What has happened, newest first, filtered by kind and text.

import { button, make, say } from "./dom.js";

/** @import { Known, Line } from "./hub.js" */

/** @type {Record<string, string>} */
const KINDS = {
  call: "Commands",
  link: "Connection",
  robot: "Robot",
  state: "Behaviours",
  note: "Notes",
  panel: "This page",
};

const LONG = /-?\d+\.\d{4,}/g; // a number with more digits than a person reads

export class Part {
  /** @param {HTMLElement} box */
  constructor(box) {
    /** @type {Line[]} */
    this.lines = [];
    /** @type {Map<Line, HTMLLIElement>} */
    this.rows = new Map();
    this.list = make("ol", { tabIndex: 0, role: "log", "aria-label": "events", "data-keys": "" });
    this.text = make("input", {
      type: "search",
      placeholder: "Filter",
      "aria-label": "text that lines must hold",
      maxLength: 100,
      oninput: () => this.filter(),
    });
    this.kinds = Object.keys(KINDS).map((value) =>
      make("input", { type: "checkbox", checked: true, value, onchange: () => this.filter() }),
    );
    this.none = make("p", { className: "hint", textContent: "Nothing yet." });
    const checks = this.kinds.map((input) => make("label", { className: "check" }, input, KINDS[input.value]));
    box.classList.add("events");
    this.cleared = 0; // the number of the last line that was cleared
    const clear = button("Clear", () => {
      this.cleared = this.lines.at(-1)?.number ?? 0;
      this.filter();
    });
    box.append(make("div", { className: "row wrap" }, this.text, ...checks, clear), this.none, this.list);
  }

  /** @param {Known} robot */
  show({ lines, tick }) {
    if (lines === this.lines) return;
    this.lines = lines;
    const now = Date.now() - 1000 * tick.time;
    for (const [line, row] of this.rows)
      if (!lines.includes(line)) {
        row.remove();
        this.rows.delete(line);
      }
    for (const line of lines)
      if (!this.rows.has(line)) {
        const row = make(
          "li",
          { className: line.bad ? "bad" : "" },
          make("time", { textContent: new Date(now + 1000 * line.time).toTimeString().slice(0, 8) }),
          make("span", { className: "kind", textContent: KINDS[line.kind] }),
          make("span", { textContent: line.text.replace(LONG, (digits) => String(+Number(digits).toFixed(3))) }),
        );
        this.rows.set(line, row);
        this.list.prepend(row);
      }
    this.filter();
  }

  filter() {
    const kinds = this.kinds.filter((input) => input.checked).map((input) => input.value),
      text = this.text.value.toLowerCase();
    this.none.hidden = false;
    say(this.none, (this.lines.at(-1)?.number ?? 0) > this.cleared ? "No line matches." : "Nothing yet.");
    for (const [line, row] of this.rows) {
      row.hidden = line.number <= this.cleared || !kinds.includes(line.kind) || !line.text.toLowerCase().includes(text);
      if (!row.hidden) this.none.hidden = true;
    }
  }
}
