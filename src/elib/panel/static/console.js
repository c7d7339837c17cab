// A line to the robot, with completion and the help of the command; what it answered stands above.

import { make, say } from "./dom.js";

/** @import { Remote } from "./dom.js" */

const KEPT = 200;
const USE = "Choose or type a command. Tab completes it; ↑ and ↓ bring back what you sent.";
const EXAMPLES = ["help", "selector", "set_led 0 on", "play_sound 1"];

export class Part {
  /** @param {HTMLElement} box @param {Remote} robot */
  constructor(box, robot) {
    this.robot = robot;
    /** @type {string[]} */
    this.past = [];
    this.at = 0; // in the past
    /** @type {string[]} */
    this.choices = [];
    this.output = make("ol", { tabIndex: 0, role: "log", "aria-label": "answers", "data-keys": "" });
    this.input = make("input", {
      type: "text",
      maxLength: 200,
      autocomplete: "off",
      autocapitalize: "none",
      spellcheck: false,
      placeholder: "set_led 0 on",
      "aria-label": "command",
      "aria-describedby": "console-help",
      role: "combobox",
      "aria-expanded": "false",
      "aria-controls": "console-choices",
      oninput: () => this.typed(),
      onkeydown: (/** @type {KeyboardEvent} */ event) => this.press(event),
    });
    this.list = make("ul", { role: "listbox", id: "console-choices", "aria-label": "completions" });
    this.help = make("p", { className: "hint", id: "console-help", role: "status", textContent: USE });
    const form = make("form", { className: "row" }, this.input, make("button", { className: "plain" }, "Send"));
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.send();
    });
    box.classList.add("console");
    box.append(this.output, form, this.list, this.help);
    this.offer(EXAMPLES);
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    if (event.key === "Tab" && !event.shiftKey && this.choices.length && this.input.value) {
      const shared = this.choices.reduce((so, each) => {
        while (!each.startsWith(so)) so = so.slice(0, -1);
        return so;
      });
      const next = this.choices.length === 1 ? `${shared} ` : shared;
      if (next.length <= this.input.value.length) return; // nothing to complete: Tab goes on to the next control
      event.preventDefault();
      this.fill(next);
    } else if (event.key === "ArrowUp" || event.key === "ArrowDown") {
      event.preventDefault();
      this.at = Math.max(0, Math.min(this.past.length, this.at + (event.key === "ArrowUp" ? -1 : 1)));
      this.fill(this.past[this.at] ?? "");
    }
  }

  /** @param {string} text */
  fill(text) {
    this.input.value = text;
    this.input.focus();
    this.typed();
  }

  /** Ask what the line may become, and what it means. */
  async typed() {
    const text = this.input.value,
      answer = await this.robot.ask("complete", { line: text });
    if (!answer.ok || text !== this.input.value) return;
    this.choices = answer.result.choices;
    this.offer(text ? this.choices.slice(0, 12) : EXAMPLES);
    this.input.setAttribute("aria-expanded", String(this.choices.length > 0));
    say(this.help, answer.result.help || (text ? "" : USE));
  }

  /** @param {string[]} lines that a click puts in */
  offer(lines) {
    this.list.replaceChildren(
      ...lines.map((line) => make("li", { role: "option", textContent: line, onclick: () => this.fill(`${line} `) })),
    );
  }

  async send() {
    const text = this.input.value.trim();
    if (!text) return;
    this.past.push(text);
    this.at = this.past.length;
    this.line("sent", text);
    const work = this.robot.ask("console", { line: text });
    window.dispatchEvent(new CustomEvent("elib-drives")); // should it move the robot, this page is the one that drives
    this.fill("");
    const answer = await work;
    if (answer.ok) this.line(answer.result.is_bad ? "bad" : "came", answer.result.text);
  }

  /** @param {string} kind @param {string} text */
  line(kind, text) {
    this.output.append(make("li", { className: kind, textContent: text }));
    while (this.output.childElementCount > KEPT) this.output.firstChild?.remove();
    this.output.scrollTop = this.output.scrollHeight;
  }
}
