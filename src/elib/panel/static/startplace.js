// The start page: a robot is chosen from those that were found or used before, from the virtual worlds, or by its URL.

import { button, make } from "./dom.js";
import { hub } from "./hub.js";

/** @import { App, Hello } from "./app.js" */
/** @import { Known } from "./hub.js" */

/** @typedef {{ url: string, description: string, firmware: string | null, reason: string }} Found a link that may lead to a robot */

/** @type {[url: string, text: string][]} */
const EXAMPLES = [
  ["serial:///dev/rfcomm0", "Bluetooth or a cable, on Linux"],
  ["serial://COM4", "Bluetooth or a cable, on Windows"],
  ["tcp://192.168.1.20:1000", "a robot in the network"],
  ["sim://crowd?robots=20", "twenty virtual robots"],
];
const PAIRING = [
  "Switch the robot on.",
  "Open the Bluetooth settings of this computer and pair e-puck_NNNN. The PIN is the number NNNN, also on the robot.",
  "On Linux, bind it to a port: sudo rfcomm bind 0 and the address of the robot, then 1 (an e-puck2: 2).",
  "Look again. If it does not answer, connect it: the doctor then says why, and where its selector must stand.",
];
const RECENT = 4; // robots that were used before, in view
const CONNECTING = 15000; // ms that a demo waits for its robot

export class StartPlace {
  /** @param {App} app */
  constructor(app) {
    this.app = app;
    this.hello = /** @type {Hello} */ (app.hello);
    this.found = make("div", { className: "choices" });
    this.used = make("div", { className: "used" });
    this.box = make(
      "div",
      { className: "start" },
      make("h1", { textContent: "Which robot do you want to drive?" }),
      make(
        "section",
        { className: "card", "aria-label": "robots of this computer" },
        make(
          "div",
          { className: "row" },
          make("h2", { textContent: "Robots" }),
          button("Look again", () => this.find()),
        ),
        this.found,
        this.used,
      ),
      make(
        "section",
        { "aria-label": "virtual robots" },
        make("h2", { textContent: "No robot at hand? Take a virtual one" }),
        make("div", { className: "worlds" }, ...this.hello.worlds.map((world) => this.world(world))),
      ),
      this.byUrl(),
    );
    this.find();
    this.remember(app.ask("recents"));
  }

  close() {}

  // Real robots

  async find() {
    this.found.replaceChildren(hint("Looking for robots …"));
    const answer = await this.app.ask("find");
    /** @type {Found[]} */
    const found = answer.ok ? answer.result : [];
    const there = found.filter((each) => each.firmware),
      silent = found.filter((each) => !each.firmware);
    this.found.replaceChildren(...there.map(({ url, firmware, description }) => this.choice(url, `${firmware}, ${description}`)));
    if (!there.length)
      this.found.append(
        hint("No robot answered. Is it switched on and paired?"),
        make(
          "details",
          { className: "hint" },
          make("summary", { textContent: "How do I pair it?" }),
          make("ol", {}, ...PAIRING.map((textContent) => make("li", { textContent }))),
        ),
      );
    if (silent.length)
      this.found.append(
        make(
          "details",
          {},
          make("summary", { textContent: `${silent.length} more that did not answer` }),
          ...silent.map(({ url, reason }) => this.choice(url, reason)),
        ),
      );
  }

  /**
   * Show the robots that were used before.
   * @param {ReturnType<App["ask"]>} asked
   */
  async remember(asked) {
    const answer = await asked;
    if (!answer.ok) return;
    /** @type {string[]} */
    const urls = answer.result;
    const [shown, folded] = [urls.slice(0, RECENT), urls.slice(RECENT)].map((some) => some.map((url) => this.row(url)));
    this.used.replaceChildren(...(shown.length ? [make("h3", { textContent: "Used before" }), ...shown] : []));
    if (folded.length)
      this.used.append(make("details", {}, make("summary", { textContent: `${folded.length} more` }), ...folded));
  }

  /** @param {string} url of a robot that was used before */
  row(url) {
    return make(
      "div",
      { className: "row" },
      this.choice(url),
      button("×", () => this.remember(this.app.ask("forget", { url })), { "aria-label": `forget ${url}` }),
    );
  }

  /** @param {string} url @param {string} [text] */
  choice(url, text) {
    const chosen = button("", () => this.app.add(url), { className: "plain choice" });
    chosen.append(make("b", { textContent: url }));
    if (text) chosen.append(make("span", { className: "hint", textContent: text }));
    return chosen;
  }

  byUrl() {
    const url = make("input", {
      type: "text",
      maxLength: 500,
      required: true,
      autocomplete: "off",
      spellcheck: false,
      "aria-label": "URL of the robot",
      placeholder: EXAMPLES[0][0],
    });
    const connect = button("Connect", () => url.reportValidity() && this.app.add(url.value.trim()), {
      className: "primary",
    });
    const form = make("form", { className: "row" }, url, connect);
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      connect.click();
    });
    /** @param {string} example */
    const use = (example) => {
      url.value = example;
      url.focus();
    };
    return make(
      "details",
      { className: "card", open: !matchMedia("(max-width: 720px)").matches },
      make("summary", { textContent: "Connect by its address" }),
      form,
      hint("Click an example to put it into the field, then change it:"),
      make(
        "dl",
        {},
        ...EXAMPLES.flatMap(([example, text]) => [
          make(
            "dt",
            {},
            button(example, () => use(example), { className: "link-like" }),
          ),
          make("dd", { textContent: text }),
        ]),
      ),
    );
  }

  // Virtual ones

  /** @param {Hello["worlds"][number]} world */
  world({ name, about, robots, firmware }) {
    const demos = this.hello.behaviours.filter((each) => !each.elsewhere && each.world.split("?")[0] === name);
    const facts = [robots === 1 ? "1 robot" : `${robots} robots`, firmware].filter(Boolean).join(", ");
    return make(
      "article",
      { className: "card world-card", "aria-label": name },
      make("img", { src: `worlds/${name}.png`, alt: `${name} from above`, loading: "lazy", width: 320, height: 200 }),
      make("h3", { textContent: name }),
      make("p", { textContent: about }),
      hint(facts),
      make(
        "div",
        { className: "row wrap" },
        button("Open", () => this.app.add(`sim://${name}`), { className: "primary" }),
        ...demos.slice(0, 2).map((each) =>
          button(`Demo: ${each.name.replaceAll("-", " ")}`, () => this.play(name, each.name), {
            title: each.summary,
          }),
        ),
      ),
    );
  }

  /**
   * Open a world and start a behaviour in it as soon as its robot is connected.
   * @param {string} world
   * @param {string} behaviour
   */
  async play(world, behaviour) {
    const answer = await this.app.add(`sim://${world}`);
    if (!answer.ok) return;
    const [key] = answer.result;
    await new Promise((resolve) => {
      setTimeout(resolve, CONNECTING);
      const unlisten = hub.listen(key, (/** @type {Known} */ { tick }) => {
        if (tick.phase !== "connected") return;
        setTimeout(() => unlisten());
        resolve(null);
      });
    });
    await this.app.ask("behave", { robots: [key], name: behaviour });
  }
}

/** @param {string} textContent */
function hint(textContent) {
  return make("p", { className: "hint", textContent });
}
