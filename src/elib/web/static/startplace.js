// The start page: a robot is chosen by its URL, from those that were found or used before, or from the virtual worlds.

import { make, pending } from "./dom.js";
import { hub } from "./hub.js";

/** @import { App, Hello } from "./app.js" */
/** @import { Known } from "./hub.js" */

/** @typedef {{ url: string, text: string, firmware: string, reason: string }} Found a link that may lead to a robot */

/** @type {[url: string, text: string][]} */
const EXAMPLES = [
  ["serial:///dev/rfcomm0", "Bluetooth or a cable, on Linux"],
  ["serial://COM4", "Bluetooth or a cable, on Windows"],
  ["tcp://192.168.1.20:1000", "a robot in the network"],
  ["sim://crowd?robots=20", "twenty virtual robots"],
];
const CONNECTING = 15000; // ms that a demo waits for its robot

export class StartPlace {
  /** @param {App} app */
  constructor(app) {
    this.app = app;
    this.hello = /** @type {Hello} */ (app.hello);
    this.found = make("div", { className: "choices" });
    this.box = make(
      "div",
      { className: "start" },
      make("h1", { textContent: "Which robot do you want to drive?" }),
      make("div", { className: "real" }, this.robots(), this.byUrl()),
      this.worlds(),
    );
    this.find();
  }

  close() {}

  // Real robots

  robots() {
    const again = make("button", { type: "button", className: "plain", textContent: "Look again" });
    again.addEventListener("click", () => pending(again, this.find()));
    const section = make(
      "section",
      { className: "card", "aria-label": "robots of this computer" },
      make("div", { className: "row wrap" }, make("h2", { textContent: "Robots" }), again),
      this.found,
    );
    const { recents } = this.hello;
    if (recents.length)
      section.append(
        make("h3", { textContent: "Used before" }),
        make("div", { className: "choices" }, ...recents.map((url) => this.choice(url, ""))),
      );
    return section;
  }

  async find() {
    this.found.replaceChildren(make("p", { className: "hint", textContent: "Looking for robots …" }));
    const answer = await this.app.ask("find");
    /** @type {Found[]} */
    const found = answer.ok ? answer.result : [];
    const there = found.filter((each) => each.firmware);
    const silent = found.filter((each) => !each.firmware);
    this.found.replaceChildren(
      ...there.map((each) => this.choice(each.url, [each.firmware, each.text].filter(Boolean).join(", "))),
    );
    if (!there.length)
      this.found.append(
        make("p", { className: "hint", textContent: "No robot answered. Is it switched on and paired?" }),
      );
    if (silent.length)
      this.found.append(
        make(
          "details",
          {},
          make("summary", { textContent: `${silent.length} more that did not answer` }),
          ...silent.map((each) => this.choice(each.url, each.reason)),
        ),
      );
  }

  /** @param {string} url @param {string} text */
  choice(url, text) {
    const button = make(
      "button",
      { type: "button", className: "plain choice" },
      make("b", { textContent: url }),
      make("span", { className: "hint", textContent: text }),
    );
    button.addEventListener("click", () => pending(button, this.app.add(url)));
    return button;
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
    const connect = make("button", { className: "primary", textContent: "Connect" });
    const form = make("form", { className: "row" }, url, connect);
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      pending(connect, this.app.add(url.value.trim()));
    });
    const examples = EXAMPLES.flatMap(([example, text]) => {
      const use = make("button", { type: "button", className: "link-like", textContent: example });
      use.addEventListener("click", () => {
        url.value = example;
        url.focus();
      });
      return [make("dt", {}, use), make("dd", { textContent: text })];
    });
    return make(
      "section",
      { className: "card", "aria-label": "connect by URL" },
      make("h2", { textContent: "Connect by its URL" }),
      form,
      make("dl", { className: "ways" }, ...examples),
    );
  }

  // Virtual ones

  worlds() {
    return make(
      "section",
      { className: "virtual", "aria-label": "virtual robots" },
      make("h2", { textContent: "No robot at hand? Take a virtual one" }),
      make("div", { className: "worlds" }, ...this.hello.worlds.map((world) => this.world(world))),
    );
  }

  /** @param {Hello["worlds"][number]} world */
  world({ name, about, robots, firmware }) {
    const open = make("button", { type: "button", className: "primary", textContent: "Open" });
    open.addEventListener("click", () => pending(open, this.app.add(`sim://${name}`)));
    const demos = this.hello.behaviours.filter((each) => !each.elsewhere && each.world.split("?")[0] === name);
    const facts = [robots === 1 ? "1 robot" : `${robots} robots`, firmware].filter(Boolean).join(", ");
    return make(
      "article",
      { className: "card world-card", "aria-label": name },
      make("img", { src: `worlds/${name}.png`, alt: `${name} from above`, loading: "lazy", width: 320, height: 200 }),
      make("h3", { textContent: name }),
      make("p", { textContent: about }),
      make("p", { className: "hint", textContent: facts }),
      make("div", { className: "row wrap" }, open, ...demos.slice(0, 2).map((each) => this.demo(name, each.name))),
    );
  }

  /** @param {string} world @param {string} behaviour */
  demo(world, behaviour) {
    const button = make("button", { type: "button", className: "plain", textContent: `Demo: ${behaviour}` });
    button.addEventListener("click", () => pending(button, this.play(world, behaviour)));
    return button;
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
      const timer = setTimeout(resolve, CONNECTING);
      const unlisten = hub.listen(key, (/** @type {Known} */ { tick }) => {
        if (tick.phase !== "connected") return;
        clearTimeout(timer);
        setTimeout(() => unlisten());
        resolve(null);
      });
    });
    await this.app.ask("behave", { robots: [key], name: behaviour });
  }
}
