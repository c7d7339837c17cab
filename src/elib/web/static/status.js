// How the robot is connected, and what to do where it is not.

import { make, say } from "./dom.js";

/** @import { Known, Phase, Tick } from "./hub.js" */

const MARKS = { ok: "✓", warning: "!", failed: "✗", skipped: "–" };
const WORDS = { ok: "fine", warning: "look at it", failed: "failed", skipped: "not looked at" };

export class Part {
  /** @param {HTMLElement} box */
  constructor(box) {
    this.news = ""; // tells whether the trouble is new
    box.classList.add("status");
    this.chip = make("p", { className: "chip", role: "status" });
    this.facts = make("p", { className: "facts" });
    this.alarm = make("p", { className: "alarm", role: "alert", hidden: true });
    this.trouble = make("div", { className: "trouble", hidden: true });
    box.append(make("div", { className: "row wrap" }, this.chip, this.facts), this.alarm, this.trouble);
  }

  /** @param {Known} robot */
  show({ tick, scheme }) {
    const { phase, drive, error, doctor } = tick;
    this.chip.dataset.phase = phase;
    say(this.chip, tick.phase_text);
    say(
      this.facts,
      [
        scheme?.firmware,
        tick.link?.median ? `${Math.round(1000 * tick.link.median)} ms` : "",
        tick.log ? "logging" : "",
        tick.recorder ? "recording" : "",
      ]
        .filter(Boolean)
        .join(" · "),
    );
    // The worst news first: nobody can stop a robot whose link is gone.
    const isGone = drive.may_move && phase !== "connected";
    const alarm = isGone
      ? "The link is gone: the robot may still be moving. Be ready to hold it."
      : drive.trouble
        ? `Not confirmed: ${drive.trouble}`
        : "";
    say(this.alarm, alarm);
    this.alarm.hidden = !alarm;
    const news = JSON.stringify([phase, error, doctor]);
    if (news === this.news) return;
    this.news = news;
    this.trouble.hidden = !error || phase === "connected";
    if (error && phase !== "connected") this.trouble.replaceChildren(...this.story(error, doctor, phase));
  }

  /** @param {NonNullable<Tick["error"]>} error @param {Tick["doctor"]} doctor @param {Phase} phase */
  story(error, doctor, phase) {
    const parts = [make("h3", { textContent: error.message })];
    if (error.hint) parts.push(make("p", { textContent: `Try: ${error.hint}` }));
    if (!doctor)
      return phase === "failed"
        ? [...parts, make("p", { className: "hint", textContent: "The doctor is looking …" })]
        : parts;
    const skipped = doctor.steps.filter((step) => step.state === "skipped");
    const steps = doctor.steps
      .filter((step) => step.state !== "skipped")
      .map((step) =>
        make(
          "li",
          { className: step.state },
          make("b", { textContent: MARKS[step.state], "aria-label": WORDS[step.state] }),
          make("span", { textContent: step.name }),
          make("span", { textContent: step.detail }),
          ...(step.fix ? [make("p", { className: "fix", textContent: step.fix })] : []),
        ),
      );
    return [
      ...parts,
      make("p", { className: "hint", textContent: "What the doctor found:" }),
      make("ul", { className: "doctor" }, ...steps),
      ...(skipped.length
        ? [
            make("p", {
              className: "hint",
              textContent: `Not looked at therefore: ${skipped.map((step) => step.name).join(", ")}.`,
            }),
          ]
        : []),
    ];
  }
}
