// Behaviours: chosen, set, started, paused and ended, with what a running one does and says, and the source text.

import { make, number, pending, say } from "./dom.js";

/** @import { App } from "./app.js" */
/** @import { Remote } from "./dom.js" */
/** @import { Known, Play } from "./hub.js" */

/**
 * @typedef {object} Behaviour
 * @property {string} name
 * @property {string} group
 * @property {string} summary
 * @property {string} world where it is at home
 * @property {string} elsewhere why it cannot run here; empty if it can
 * @property {Option_[]} options
 */

/**
 * @typedef {object} Option_ of a behaviour
 * @property {string} name
 * @property {string} unit
 * @property {number | null} low
 * @property {number | null} high
 * @property {number | string | null} default
 * @property {boolean} whole only whole numbers
 * @property {string} rule what it may be, in words
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
    this.robot = robot;
    /** @type {Map<string, Behaviour>} */
    this.known = new Map((app.hello?.behaviours ?? []).map((each) => [each.name, each]));
    /** @type {Map<string, HTMLInputElement>} */
    this.fields = new Map();
    this.phase = "";
    this.lines = 0; // that are shown
    this.choice = make("select", { "aria-label": "behaviour", onchange: () => this.choose() }, ...this.groups());
    this.choice.value = this.known.has(FIRST) ? FIRST : (this.known.keys().next().value ?? "");
    this.about = make("p", { className: "hint" });
    this.form = make("div", { className: "options" });
    /** @type {(text: string, kind: string, act: () => Promise<unknown>) => HTMLButtonElement} */
    const button = (text, kind, act) => {
      const made = make("button", { type: "button", className: kind, textContent: text });
      made.addEventListener("click", () => pending(made, act()));
      return made;
    };
    const one = { robots: [robot.key] };
    this.startButton = button("Start", "primary", () => this.start([robot.key]));
    this.startAll = button("Start for all robots", "plain", () => this.start(app.robots.map((each) => each.key)));
    this.pause = button("Pause", "plain", () =>
      app.ask(this.phase === "paused" ? "resume_behaviour" : "pause_behaviour", one),
    );
    this.end = button("End", "plain", () => app.ask("end_behaviour", one));
    this.chip = make("p", { className: "chip", role: "status" });
    this.doing = make("p", { className: "hint" });
    this.bad = make("p", { className: "alarm", hidden: true });
    this.log = make("ol", { tabIndex: 0, role: "log", "aria-label": "what the behaviour says", "data-keys": "" });
    this.code = make("code");
    this.source = make(
      "details",
      { className: "source" },
      make("summary", { textContent: "Source text" }),
      make("pre", { tabIndex: 0, "aria-label": "source text", "data-keys": "" }, this.code),
    );
    this.source.addEventListener("toggle", () => this.showSource());
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

  groups() {
    /** @type {Map<string, HTMLOptGroupElement>} */
    const groups = new Map();
    for (const { name, group } of this.known.values()) {
      const list = groups.get(group) ?? make("optgroup", { label: group });
      groups.set(group, list);
      list.append(new Option(name));
    }
    return groups.values();
  }

  /** Show what the chosen behaviour is, and its options. */
  choose() {
    const chosen = this.known.get(this.choice.value);
    if (!chosen) return;
    const home = chosen.world ? ` At home in sim://${chosen.world}.` : "";
    say(this.about, chosen.elsewhere ? `It cannot run here: ${chosen.elsewhere}.` : `${chosen.summary}${home}`);
    this.fields = new Map(chosen.options.map((option) => [option.name, this.field(option)]));
    this.form.replaceChildren(
      ...chosen.options.map((option) =>
        make(
          "label",
          { className: "field", title: option.rule },
          option.unit ? `${option.name}, ${option.unit}` : option.name,
          /** @type {HTMLInputElement} */ (this.fields.get(option.name)),
        ),
      ),
    );
    this.startButton.disabled = Boolean(chosen.elsewhere);
    this.startAll.disabled = Boolean(chosen.elsewhere);
    this.showSource();
  }

  /** @param {Option_} option */
  field({ low, high, whole, rule, default: value }) {
    const input = make("input", { type: typeof value === "string" ? "text" : "number", placeholder: rule });
    if (low !== null) input.min = String(low);
    if (high !== null) input.max = String(high);
    if (input.type === "number") input.step = whole ? "1" : "any";
    input.value = value === null ? "" : String(value);
    return input;
  }

  /** @param {string[]} robots their keys */
  async start(robots) {
    const options = new Map();
    for (const [name, field] of this.fields) {
      if (!field.reportValidity()) return;
      if (field.value !== "") options.set(name, field.type === "number" ? field.valueAsNumber : field.value);
    }
    await this.app.ask("behave", { robots, name: this.choice.value, options: Object.fromEntries(options) });
  }

  /** Fetch the source text when it is folded open. */
  async showSource() {
    if (!this.source.open) return;
    const name = this.choice.value;
    const answer = await this.app.ask("source", { name });
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
    const isActive = behaviour.phase === "running" || behaviour.phase === "paused";
    const isHere = tick.phase === "connected" && !this.known.get(this.choice.value)?.elsewhere;
    this.startButton.disabled = isActive || !isHere;
    this.pause.disabled = this.end.disabled = !isActive;
    say(this.pause, behaviour.phase === "paused" ? "Continue" : "Pause");
    this.phase = behaviour.phase;
    this.chip.dataset.phase = COLOURS[behaviour.phase] ?? "";
    say(this.chip, behaviour.name ? `${behaviour.name}: ${behaviour.phase_text}` : "No behaviour has run yet.");
    say(
      this.doing,
      [
        behaviour.state && `state: ${behaviour.state}`,
        behaviour.reason,
        behaviour.name && `${number(behaviour.time, 1)} s`,
      ]
        .filter(Boolean)
        .join(" · "),
    );
    this.bad.hidden = !behaviour.error;
    say(this.bad, behaviour.error);
    this.showLines(behaviour);
  }

  /** @param {Play} play */
  showLines({ count, lines }) {
    if (count === this.lines) return;
    if (count < this.lines) this.log.replaceChildren();
    const fresh = count < this.lines ? lines : lines.slice(-(count - this.lines));
    this.lines = count;
    this.log.append(
      ...fresh.map(([time, text]) =>
        make("li", {}, make("time", { textContent: `${number(time, 1)} s` }), make("span", { textContent: text })),
      ),
    );
    while (this.log.childElementCount > KEPT) this.log.firstChild?.remove();
    this.log.scrollTop = this.log.scrollHeight;
  }
}
