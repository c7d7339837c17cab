// A behaviour at work: how it stands, what it does, what it said.

import { make, number, say } from "./dom.js";
import { hub } from "./hub.js";

/** @import { Play } from "./hub.js" */

const KEPT = 300;
/** @type {Record<string, string>} */
const PHASES = { running: "connected", paused: "gap", failed: "failed" }; // of a robot, with the same colour

export class Part {
  /** @param {HTMLElement} box */
  constructor(box) {
    this.chip = make("p", { className: "chip", role: "status" });
    this.doing = make("p", { className: "hint" });
    this.bad = make("p", { className: "alarm", hidden: true });
    this.list = make("ol", { tabIndex: 0, role: "log", "aria-label": "what the behaviour says", "data-keys": "" });
    box.classList.add("play");
    box.append(this.chip, this.doing, this.bad, this.list);
    this.count = 0;
    this.deaf = hub.listen("play", (news) => this.take(news));
  }

  close() {
    this.deaf();
  }

  /** @param {Play} news */
  take(news) {
    this.chip.dataset.phase = PHASES[news.act] ?? "";
    say(this.chip, news.name ? `${news.name}: ${news.act_text}` : "No behaviour has run yet.");
    say(
      this.doing,
      [news.state && `state: ${news.state}`, news.reason, news.name && `${number(news.time, 1)} s`]
        .filter(Boolean)
        .join(" · "),
    );
    this.bad.hidden = !news.error;
    say(this.bad, news.error);
    if (news.count < this.count) this.list.replaceChildren();
    this.count = news.count;
    if (!news.lines.length) return;
    this.list.append(
      ...news.lines.map(([time, text]) =>
        make("li", {}, make("time", { textContent: `${number(time, 1)} s` }), make("span", { textContent: text })),
      ),
    );
    while (this.list.childElementCount > KEPT) this.list.firstChild?.remove();
    this.list.scrollTop = this.list.scrollHeight;
  }
}
