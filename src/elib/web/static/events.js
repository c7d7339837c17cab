// What has happened, newest last, filtered by kind and text.

import { make, say } from "./dom.js";

/** @import { Known, Line } from "./hub.js" */

const KINDS = ["call", "link", "robot", "state", "note", "panel"];

export class Part {
  /** @param {HTMLElement} box */
  constructor(box) {
    /** @type {Line[]} */
    this.lines = [];
    this.now = 0; // s on the server's clock
    /** @type {Map<number, HTMLLIElement>} */
    this.shown = new Map();
    this.list = make("ol", { tabIndex: 0, role: "log", "aria-label": "events", "data-keys": "" });
    this.filter = make("input", {
      type: "search",
      placeholder: "Filter",
      "aria-label": "text that lines must hold",
      maxLength: 100,
      oninput: () => this.renew(),
    });
    this.kinds = KINDS.map((kind) =>
      make("input", { type: "checkbox", checked: true, value: kind, onchange: () => this.renew() }),
    );
    this.none = make("p", { className: "hint", textContent: "Nothing yet." });
    box.classList.add("events");
    box.append(
      make(
        "div",
        { className: "row wrap" },
        this.filter,
        ...this.kinds.map((input, k) => make("label", { className: "check" }, input, KINDS[k])),
      ),
      this.none,
      this.list,
    );
  }

  /** @param {Known} robot */
  show(robot) {
    if (robot.lines === this.lines) return;
    this.lines = robot.lines;
    this.now = robot.tick.time;
    this.renew();
  }

  renew() {
    const kinds = new Set(this.kinds.filter((input) => input.checked).map((input) => input.value)),
      text = this.filter.value.toLowerCase();
    const wanted = this.lines.filter((line) => kinds.has(line.kind) && line.text.toLowerCase().includes(text));
    const isAtEnd = this.list.scrollTop + this.list.clientHeight > this.list.scrollHeight - 30,
      kept = new Map();
    for (const line of wanted) kept.set(line.number, this.shown.get(line.number) ?? this.row(line));
    for (const [number, row] of this.shown) if (!kept.has(number)) row.remove();
    let place = this.list.firstChild;
    for (const row of kept.values()) {
      if (row === place) place = row.nextSibling;
      else this.list.insertBefore(row, place);
    }
    this.shown = kept;
    this.none.hidden = kept.size > 0;
    say(this.none, this.lines.length ? "No line matches." : "Nothing yet.");
    if (isAtEnd) this.list.scrollTop = this.list.scrollHeight;
  }

  /** @param {Line} line */
  row(line) {
    const clock = new Date(Date.now() - 1000 * (this.now - line.time)).toTimeString().slice(0, 8);
    return make(
      "li",
      { className: line.bad ? "bad" : "" },
      make("time", { textContent: clock }),
      make("span", { className: "kind", textContent: line.kind }),
      make("span", { textContent: line.text }),
    );
  }
}
