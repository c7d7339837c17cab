// The page of one robot: what is needed while driving in view together, and the rest behind tabs.

import { Part as Behaviours } from "./behaviours.js";
import { Part as Camera } from "./camera.js";
import { Part as Charts } from "./charts.js";
import { Part as Console } from "./console.js";
import { make } from "./dom.js";
import { Part as Drive } from "./drive.js";
import { Part as Events } from "./events.js";
import { Part as Files } from "./files.js";
import { hub } from "./hub.js";
import { Part as Instruments } from "./instruments.js";
import { Part as Lights } from "./lights.js";
import { Part as Link } from "./link.js";
import { Part as Playback } from "./playback.js";
import { Part as Robot } from "./robot.js";
import { Part as Status } from "./status.js";
import { Part as World } from "./world.js";

/** @import { App } from "./app.js" */
/** @import { Known } from "./hub.js" */

/**
 * A part of the page: it is made once, told what is new of the robot, and closed.
 * @typedef {{ show?: (robot: Known) => void, close?: () => void }} Part
 */

// Name, title, class, and where it stands: "always" in view, a "tab", or a "tab" of its own only on a phone: on other
// screens the world is always there, and the lights stand beside the robot.
/** @type {[name: string, title: string, kind: any, place: "always" | "phone-tab" | "tab"][]} */
const PARTS = [
  ["world", "World", World, "phone-tab"],
  ["drive", "Drive", Drive, "always"],
  ["camera", "Camera", Camera, "always"],
  ["robot", "Robot", Robot, "tab"],
  ["lights", "Lights and sounds", Lights, "phone-tab"],
  ["instruments", "Sensors", Instruments, "tab"],
  ["behaviours", "Behaviours", Behaviours, "tab"],
  ["charts", "Charts", Charts, "tab"],
  ["console", "Console", Console, "tab"],
  ["events", "Events", Events, "tab"],
  ["link", "Link", Link, "tab"],
  ["files", "Files", Files, "tab"],
];
const PHONE = matchMedia("(max-width: 720px)");

export class RobotPlace {
  /** @param {App} app @param {string} key */
  constructor(app, key) {
    const remote = app.remote(key);
    this.isOpen = new AbortController();
    const status = make("div"),
      playback = make("div");
    /** @type {Part[]} */
    this.parts = [new Status(status, remote, app), new Playback(playback, remote)];
    this.nav = make("div", { className: "part-tabs", role: "tablist", "aria-label": "parts of the page" });
    /** @type {Map<string, HTMLElement>} */
    this.sections = new Map();
    for (const [name, title, Kind, place] of PARTS) {
      const body = make("div");
      const section = make("section", { className: `card part part-${name}`, id: `part-${name}`, "aria-label": title });
      section.append(body);
      section.dataset.place = place;
      this.parts.push(new Kind(body, remote, app));
      this.sections.set(name, section);
      if (place === "always") continue;
      const tab = make("button", { type: "button", role: "tab", textContent: title, "aria-controls": section.id });
      tab.addEventListener("click", () => {
        this.turn(name);
        section.scrollIntoView({ block: "nearest" });
      });
      [tab.dataset.part, tab.dataset.place] = [name, place];
      this.nav.append(tab);
    }
    const [world, drive, camera, ...more] = this.sections.values();
    this.box = make(
      "div",
      { className: "robot-place" },
      make("section", { className: "card status-bar", "aria-label": "connection" }, status, playback),
      ...[world, drive, camera, this.nav, ...more],
    );
    const first = () => this.turn(PHONE.matches ? "world" : "robot");
    first();
    PHONE.addEventListener("change", first, { signal: this.isOpen.signal });
    this.unlisten = hub.listen(key, (/** @type {Known} */ robot) => {
      this.box.dataset.phase = robot.tick.phase;
      for (const part of this.parts) part.show?.(robot);
    });
  }

  /**
   * Open a tab.
   * @param {string} name
   */
  turn(name) {
    for (const [each, section] of this.sections) section.classList.toggle("open", each === name);
    for (const tab of /** @type {HTMLCollectionOf<HTMLElement>} */ (this.nav.children)) {
      tab.setAttribute("aria-selected", String(tab.dataset.part === name));
      if (tab.dataset.part === name) tab.scrollIntoView({ inline: "center", block: "nearest" });
    }
  }

  close() {
    this.isOpen.abort();
    this.unlisten();
    for (const part of this.parts) part.close?.();
  }
}
