// Behaviours: chosen, set, started, paused and ended, with what a running one does and says, and the source text.

import { button, make, number, say } from "./dom.js";

/** @import { App } from "./app.js" */
/** @import { Remote } from "./dom.js" */
/** @import { Known, Play } from "./hub.js" */

/**
 * @typedef {{
 *   name: string, group: string, summary: string, world: string, elsewhere: string, options: Option_[],
 * }} Behaviour `world` is where it is at home; `elsewhere` says why it cannot run here
 * @typedef {{
 *   name: string, unit: string, low: number | null, high: number | null, default: number | string | null,
 *   whole: boolean, rule: string,
 * }} Option_ of a behaviour
 */

const FIRST = "avoid";
const KEPT = 300; // lines of its log
/** @type {Record<string, string>} */
const COLOURS = { running: "connected", paused: "gap", failed: "failed" }; // as the phases of a robot have them
const WORD =
  /("""[\s\S]*?"""|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*')|(#.*)|\b(async|await|def|class|return|while|for|in|if|elif|else|from|import|as|with|try|except|finally|not|and|or|is|None|True|False|raise|pass|break|continue|yield|lambda|match|case)\b|\b(\d[\d_.]*)\b|(@\w+)/g;
const WORD_KINDS = ["text", "remark", "word", "number", "mark"];

export class Part {
  /** @param {HTMLElement} box @param {Remote} robot @param {App} app */
  constructor(box, robot, app) {
    this.app = app;
    /** @type {Map<string, Behaviour>} */
    this.known = new Map((app.hello?.behaviours ?? []).map((each) => [each.name, each]));
    /** @type {Map<string, HTMLInputElement>} */
    this.fields = new Map();
    this.phase = "";
    this.lines = 0; // that are shown
    this.choice = make("select", { onchange: () => this.choose() });
    /** @type {Record<string, HTMLOptGroupElement>} */
    const groups = {};
    for (const { name, group } of this.known.values())
      (groups[group] ??= make("optgroup", { label: group })).append(new Option(name));
    this.choice.append(...Object.values(groups));
    this.choice.value = FIRST;
    this.about = make("p", { className: "hint" });
    this.form = make("div", { className: "options" });
    const one = { robots: [robot.key] };
    this.startButton = button("Start", () => this.start([robot.key]), { className: "primary" });
    this.startAll = button("Start for all robots", () => this.start(app.robots.map((each) => each.key)));
    this.pause = button("Pause behaviour", () =>
      app.ask(this.phase === "paused" ? "resume_behaviour" : "pause_behaviour", one),
    );
    this.end = button("End behaviour", () => app.ask("end_behaviour", one));
    this.chip = make("p", { className: "chip", role: "status" });
    this.doing = make("p", { className: "hint" });
    this.bad = make("p", { className: "alarm", hidden: true });
    this.log = make("ol", { tabIndex: 0, role: "log", "aria-label": "what the behaviour says", "data-keys": "" });
    this.code = make("code");
    this.source = make(
      "details",
      { className: "source", ontoggle: () => this.showSource() },
      make("summary", { textContent: "Source text" }),
      make("pre", { tabIndex: 0, "aria-label": "source text", "data-keys": "" }, this.code),
    );
    box.classList.add("behaviours");
    box.append(
      make(
        "div",
        { className: "choice-of-behaviour" },
        make("label", { className: "field" }, "Behaviour", this.choice),
        this.about,
        this.form,
        make("div", { className: "row wrap" }, this.startButton, this.startAll, this.pause, this.end),
      ),
      make("div", { className: "play" }, this.chip, this.doing, this.bad, this.log),
      this.source,
    );
    this.choose();
  }

  get chosen() {
    return this.known.get(this.choice.value);
  }

  /** Show what the chosen behaviour is, and its options. */
  choose() {
    if (!this.chosen) return;
    const { elsewhere, summary, world, options } = this.chosen;
    const home = world ? ` At home in sim://${world}.` : "";
    say(this.about, elsewhere ? `It cannot run here: ${elsewhere}.` : `${summary}${home}`);
    this.fields.clear();
    this.form.replaceChildren(...options.map((option) => this.option(option)));
    this.showSource();
  }

  /** @param {Option_} option */
  option({ name, unit, low, high, whole, rule, default: value }) {
    const isText = typeof value === "string";
    const field = make("input", {
      type: isText ? "text" : "number",
      placeholder: rule,
      min: low ?? "",
      max: high ?? "",
      step: whole ? "1" : "any",
      value: value ?? "",
    });
    this.fields.set(name, field);
    return make("label", { className: "field", title: rule }, unit ? `${name}, ${unit}` : name, field);
  }

  /** @param {string[]} robots their keys */
  async start(robots) {
    /** @type {Record<string, number | string>} */
    const options = {};
    for (const [name, field] of this.fields) {
      if (!field.reportValidity()) return;
      if (field.value !== "") options[name] = field.type === "number" ? field.valueAsNumber : field.value;
    }
    await this.app.ask("behave", { robots, name: this.choice.value, options });
  }

  /** Fetch the source text when it is folded open. */
  async showSource() {
    if (!this.source.open) return;
    const name = this.choice.value,
      answer = await this.app.ask("source", { name });
    if (!answer.ok || name !== this.choice.value) return;
    /** @type {string} */
    const text = answer.result;
    const parts = [];
    let from = 0;
    for (const match of text.matchAll(WORD)) {
      const kind = WORD_KINDS[match.slice(1).findIndex((group) => group !== undefined)];
      parts.push(text.slice(from, match.index), make("span", { className: kind, textContent: match[0] }));
      from = match.index + match[0].length;
    }
    this.code.replaceChildren(...parts, text.slice(from));
  }

  /** @param {Known} robot */
  show({ behaviour, tick }) {
    this.startAll.hidden = this.app.robots.length < 2;
    if (!behaviour) return;
    const { name, phase, phase_text, state, reason, error, time } = behaviour,
      isActive = phase === "running" || phase === "paused";
    this.startAll.disabled = Boolean(this.chosen?.elsewhere);
    this.startButton.disabled = isActive || tick.phase !== "connected" || this.startAll.disabled;
    this.pause.disabled = this.end.disabled = !isActive;
    say(this.pause, phase === "paused" ? "Continue behaviour" : "Pause behaviour");
    this.phase = phase;
    this.chip.dataset.phase = COLOURS[phase] ?? "";
    say(this.chip, name ? `${name}: ${phase_text}` : "No behaviour has run yet.");
    const doing = isActive
      ? [state && `state: ${state}`, reason, `${number(time, 1)} s`]
      : [name && `ran ${number(time, 1)} s`, state && `last state: ${state}`];
    say(this.doing, doing.filter(Boolean).join(" · "));
    this.bad.hidden = !error;
    say(this.bad, error);
    this.showLines(behaviour);
  }

  /** @param {Play} play */
  showLines({ count, lines }) {
    if (count === this.lines) return;
    if (count < this.lines) {
      this.log.replaceChildren();
      this.lines = 0;
    }
    for (const [time, text] of lines.slice(this.lines - count))
      this.log.append(
        make("li", {}, make("time", { textContent: `${number(time, 1)} s` }), make("span", { textContent: text })),
      );
    this.lines = count;
    while (this.log.childElementCount > KEPT) this.log.firstChild?.remove();
    this.log.scrollTop = this.log.scrollHeight;
  }
}
