// How the robot is connected, and what to do where it is not.

import { button, confirmed, make, number, say } from "./dom.js";

/** @import { App } from "./app.js" */
/** @import { Remote } from "./dom.js" */
/** @import { Known, Phase, Tick } from "./hub.js" */

const SLOW = 0.3; // s to an answer that a person feels while driving
const MARKS = { ok: "✓", warning: "!", failed: "✗", skipped: "–" };
const WORDS = { ok: "fine", warning: "look at this", failed: "failed", skipped: "not checked" };

export class Part {
  /** @param {HTMLElement} box @param {Remote} robot @param {App} app */
  constructor(box, robot, app) {
    this.robot = robot;
    this.app = app;
    this.news = ""; // tells whether the trouble is new
    /** @type {Phase} */
    this.phase = "disconnected";
    box.classList.add("status");
    this.name = make("h1");
    this.chip = make("p", { className: "chip", role: "status" });
    this.slow = make("p", { className: "slow" });
    this.writing = make("p", { className: "writing" });
    this.facts = make("p", { className: "facts" });
    this.connect = button("Connect", () => this.change());
    this.alarm = make("p", { className: "alarm", role: "alert", hidden: true });
    this.trouble = make("div", { className: "trouble", hidden: true });
    const buttons = make("div", { className: "row" }, this.connect);
    // The robots of a simulation that shows its own page belong to it.
    if (!app.hello?.simulation) {
      const title = "The robot itself and its files stay as they are";
      const remove = button("Remove", () => this.remove(), { title });
      remove.append(make("span", { className: "from-page", textContent: " from page" }));
      buttons.append(remove);
    }
    box.append(
      make("div", { className: "row" }, this.name, this.chip, this.writing, this.slow, this.facts, buttons),
      this.alarm,
      this.trouble,
    );
  }

  get isOff() {
    return this.phase === "disconnected" || this.phase === "failed";
  }

  change() {
    return this.robot.ask(this.isOff ? "connect" : "disconnect");
  }

  async remove() {
    const sure =
      this.isOff ||
      (await confirmed(
        "Remove this robot?",
        "It stops, and its connection is closed. Files stay where they are.",
        "Remove",
      ));
    if (sure) await this.robot.ask("remove");
  }

  /** @param {Known} robot */
  show({ tick, scheme }) {
    const { phase, drive, error, doctor } = tick,
      listed = this.app.robots.find((each) => each.key === this.robot.key),
      [raw, volts, percent] = tick.readings.battery?.values ?? [];
    this.phase = phase;
    const median = tick.link?.median ?? 0,
      answers = median ? `answers in ${Math.round(1000 * median)} ms` : "",
      isSlow = median > SLOW;
    say(this.slow, isSlow ? `slow: ${answers}` : "");
    say(this.name, listed?.label ?? "");
    this.name.title = listed?.url ?? "";
    this.chip.dataset.phase = phase;
    say(this.chip, tick.phase_text);
    say(
      this.facts,
      [
        typeof raw === "number" && percent !== null
          ? `battery ${number(Number(percent))} %, ${number(Number(volts), 2)} V`
          : "",
        isSlow ? "" : answers,
        scheme?.firmware,
      ]
        .filter(Boolean)
        .join(" · "),
    );
    say(this.writing, [tick.log && "writing a log", tick.recorder && "recording"].filter(Boolean).join(", "));
    const isRecording = Boolean(listed?.url.startsWith("replay:") && !listed.url.includes("fork="));
    const [begin, end] = isRecording ? ["Play", "End"] : ["Connect", "Disconnect"];
    say(this.connect, phase === "connecting" ? "Cancel" : this.isOff ? begin : end);
    this.connect.classList.toggle("primary", this.isOff);
    // The worst news first: nobody can stop a robot whose link is gone.
    const isGone = drive.may_move && phase !== "connected";
    const alarm = isGone
      ? "The connection is lost: the robot may still be moving. Be ready to pick it up."
      : drive.trouble
        ? `The robot did not confirm the last command and may still be moving: ${drive.trouble}`
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
    if (error.hint && !doctor?.steps.some((step) => step.fix === error.hint))
      parts.push(make("p", {}, "Try: ", ...withCommand(error.hint)));
    if (!doctor)
      return phase === "failed"
        ? [...parts, make("p", { className: "hint", textContent: "Looking for the cause …" })]
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
          make("span", { textContent: error.message.endsWith(step.detail) ? "" : step.detail }), // said above
          ...(step.fix ? [make("p", { className: "fix" }, "Try: ", ...withCommand(step.fix))] : []),
        ),
      );
    return [
      ...parts,
      make("p", { className: "hint", textContent: "What was checked:" }),
      make("ul", { className: "doctor" }, ...steps),
      ...(skipped.length
        ? [
            make(
              "details",
              { className: "hint" },
              make("summary", { textContent: "Not checked because of that" }),
              skipped.map((step) => step.name).join(", "),
            ),
          ]
        : []),
    ];
  }
}

/**
 * An advice; a command at its end can be copied.
 * @param {string} advice
 */
function withCommand(advice) {
  const command = /: (elib .+)$/.exec(advice)?.[1] ?? "";
  if (!command || !navigator.clipboard) return [advice]; // browsers copy only on pages of this computer
  return [
    advice.slice(0, -command.length),
    make("code", { textContent: command }),
    " ",
    button("Copy", () => navigator.clipboard.writeText(command), { "aria-label": "copy the command" }),
  ];
}
