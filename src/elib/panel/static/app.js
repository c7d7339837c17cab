// The page: its header, the place that it shows (a robot, all robots, or the start), and what it says to the server.

import { Connection } from "./connection.js";
import { isWriting, make, say } from "./dom.js";
import { hub } from "./hub.js";
import { OverviewPlace } from "./overviewplace.js";
import { RobotPlace } from "./robotplace.js";
import { StartPlace } from "./startplace.js";

/** @import { Answer } from "./connection.js" */
/** @import { Remote } from "./dom.js" */

const TOAST_TIME = 8000; // ms

/**
 * @typedef {{ name: string, about: string, robots: number, firmware: string }} World
 * @typedef {{
 *   page: string, folder: string, worlds: World[], behaviours: any[], simulation: boolean,
 *   ring: { sensors: number[], leds: number[] }, // rad from straight ahead, positive to the left
 *   study: import("./study.js").About | null,
 * }} Hello what the server says once: the name of the page at the drive locks, the folder that files go to (empty if this
 *   page may not know it), where on the robot the sensors look and the LEDs sit (degrees), whether the page shows a
 *   world without robots of the panel, as that of `elib simulate` does, and the study that it belongs to
 */

/** @typedef {{ key: string, label: string, url: string }} Listed a robot of the panel */

export class App {
  constructor() {
    /** @type {Hello | null} */
    this.hello = null;
    /** @type {Listed[]} */
    this.robots = [];
    this.shown = ""; // the place
    /** @type {string | null} */
    this.wanted = null;
    /** @type {RobotPlace | OverviewPlace | StartPlace | null} */
    this.place = null;
    this.main = /** @type {HTMLElement} */ (document.querySelector("main"));
    this.tabs = /** @type {HTMLElement} */ (document.querySelector(".tabs"));
    this.stopButton = /** @type {HTMLButtonElement} */ (document.getElementById("stop"));
    this.toasts = /** @type {HTMLElement} */ (document.getElementById("toasts"));
    this.stopLabel = /** @type {Element} */ (this.stopButton.firstElementChild);
    this.stopButton.addEventListener("click", () => this.stop());
    window.addEventListener("keydown", (event) => this.press(event), true);
    window.addEventListener("keyup", (event) => this.release(event), true);
    document.addEventListener("elib-please-stop", () => this.stop());
    this.connection = new Connection(
      (message) => this.take(message),
      (frame) => {
        hub.spread("frame", frame);
        this.connection.tell("frame_drawn", { number: new DataView(frame).getUint32(0, true) });
      },
      () => hub.mute(true),
    );
  }

  /** @param {any} message */
  take(message) {
    switch (message.type) {
      case "hello":
        this.hello = message;
        this.wanted = sessionStorage.getItem("elib-place"); // what was shown before the page was loaded again
        this.shown = "";
        break;
      case "update":
        if (message.robots) this.robots = message.robots;
        this.goBack(message.place);
        if (message.place !== this.shown) this.build(message.place);
        else if (message.robots) this.list();
        hub.take(message);
        this.stopButton.hidden = this.hello?.simulation || !this.robots.length; // those robots belong to other programs
        say(this.stopLabel, this.stopped || this.robots.length < 2 ? "STOP" : "STOP ALL");
        this.connection.tell("drawn", { number: message.number });
        break;
      default:
        hub.spread(message.type, message); // scene, change and readings of a world
    }
  }

  // What is shown

  /**
   * Show again what was shown before the page was loaded again, if it is still there.
   * @param {string} place what the server shows
   */
  goBack(place) {
    const { wanted } = this;
    this.wanted = null;
    const isThere = wanted === "overview" ? this.robots.length > 1 : this.robots.some(({ key }) => key === wanted);
    if (wanted && wanted !== place && isThere) this.open(wanted);
  }

  /** @param {string} place the key of a robot, "overview" or "start" */
  build(place) {
    this.place?.close();
    this.shown = place;
    document.documentElement.dataset.place = this.robots.some((each) => each.key === place) ? "robot" : place;
    this.place =
      place === "start"
        ? new StartPlace(this)
        : place === "overview"
          ? new OverviewPlace(this)
          : new RobotPlace(this, place);
    this.main.replaceChildren(this.place.box);
    window.scrollTo(0, 0);
    sessionStorage.setItem("elib-place", place);
    this.list();
  }

  list() {
    const entries = this.robots.map((each) => ({ key: each.key, label: each.label, title: each.url }));
    if (this.robots.length > 1 || (this.shown === "overview" && !this.hello?.simulation))
      entries.unshift({ key: "overview", label: "All robots", title: "all robots and their world" });
    if (!this.hello?.simulation) entries.push({ key: "start", label: "+ Robot", title: "another robot" });
    this.tabs.replaceChildren(
      ...entries.map(({ key, label, title }) => {
        const tab = make("button", {
          type: "button",
          className: "tab",
          textContent: label,
          title,
          onclick: () => this.open(key),
        });
        if (key === "start") tab.setAttribute("aria-label", title);
        if (key === this.shown) tab.setAttribute("aria-current", "page");
        return tab;
      }),
    );
    this.tabs.querySelector("[aria-current]")?.scrollIntoView({ block: "nearest", inline: "nearest" });
  }

  /** @param {string} place */
  open(place) {
    return this.ask("show", { place });
  }

  /**
   * Take the robots of a URL into the panel and show them.
   * @param {string} url
   */
  async add(url) {
    const answer = await this.ask("add", { url });
    if (answer.ok) await this.open(answer.result.length > 1 ? "overview" : answer.result[0]);
    return answer;
  }

  // What is said to the server

  /**
   * Ask for something; an error is shown.
   * @param {string} what
   * @param {object} [values]
   * @returns {Promise<Answer>}
   */
  async ask(what, values = {}) {
    const answer = await this.connection.ask(what, values);
    if (!answer.ok) this.toast(`${answer.error}${answer.hint ? ` (${answer.hint})` : ""}`);
    return answer;
  }

  /**
   * A robot, as the parts of its page speak to it.
   * @param {string} key
   * @returns {Remote}
   */
  remote(key) {
    return {
      key,
      page: () => this.hello?.page ?? "",
      tell: (what, values = {}) => this.connection.tell(what, { robot: key, ...values }),
      ask: (what, values = {}) => this.ask(what, { robot: key, ...values }),
    };
  }

  /** @param {string} text */
  toast(text) {
    const toast = make(
      "div",
      { className: "toast", role: "alert" },
      make("span", { textContent: text }),
      make("button", { type: "button", "aria-label": "close", textContent: "✕", onclick: () => toast.remove() }),
    );
    this.toasts.append(toast);
    setTimeout(() => toast.remove(), TOAST_TIME);
  }

  // STOP: it asks no one and waits for nothing.

  /** The robot that STOP stops; none means all of them, as where a recording is shown while the robots drive on. */
  get stopped() {
    const phase = hub.robots.get(this.shown)?.tick?.phase ?? "disconnected";
    return ["connecting", "connected", "gap"].includes(phase) ? this.shown : "";
  }

  stop() {
    window.dispatchEvent(new CustomEvent("elib-stop"));
    this.connection.tell("stop", this.stopped ? { robot: this.stopped } : {});
    this.stopButton.classList.add("pressed");
    setTimeout(() => this.stopButton.classList.remove("pressed"), 250);
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const isSpace = event.code === "Space" && !isWriting(event.target);
    if (!isSpace && event.key !== "Escape") return;
    if (isSpace) {
      event.preventDefault(); // a button that has the focus is not pressed by it, for it could start something
      event.stopPropagation();
    }
    if (!event.repeat) this.stop();
  }

  /** @param {KeyboardEvent} event */
  release(event) {
    if (event.code === "Space" && !isWriting(event.target)) event.preventDefault();
  }
}

Object.assign(window, { app: new App() });
