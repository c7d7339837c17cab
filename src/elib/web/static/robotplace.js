// The page of one robot: what is needed while driving in view together, and the rest behind tabs.

import { Part as Camera } from "./camera.js";
import { Part as Charts } from "./charts.js";
import { Part as Behaviours } from "./behaviours.js";
import { Part as Console } from "./console.js";
import { make } from "./dom.js";
import { Part as Drive } from "./drive.js";
import { Part as Events } from "./events.js";
import { Part as Files } from "./files.js";
import { hub } from "./hub.js";
import { Part as Instruments } from "./instruments.js";
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

// Name, title, class, and whether it is always in view where there is room; on a phone all but the first are tabs.
/** @type {[name: string, title: string, kind: any, isFixed: boolean][]} */
const PARTS = [
  ["world", "World", World, true],
  ["drive", "Drive", Drive, true],
  ["camera", "Camera", Camera, true],
  ["robot", "Robot", Robot, true],
  ["instruments", "Sensors", Instruments, true],
  ["behaviours", "Behaviours", Behaviours, false],
  ["charts", "Charts", Charts, false],
  ["console", "Console", Console, false],
  ["events", "Events", Events, false],
  ["link", "Link", Link, false],
  ["files", "Files", Files, false],
];
const ON_PHONES = ["drive", "camera"]; // in view on a phone whatever tab is open

export class RobotPlace {
  /** @param {App} app @param {string} key */
  constructor(app, key) {
    this.app = app;
    const remote = app.remote(key);
    /** @type {Part[]} */
    this.parts = [];
    this.box = make("div", { className: "robot-place" });
    const status = make("section", { className: "card status-bar", "aria-label": "connection" });
    const playback = make("div");
    this.parts.push(new Status(status, remote, app), new Playback(playback, remote));
    status.append(playback);
    this.box.append(status);
    this.nav = make("div", { className: "part-tabs", role: "tablist", "aria-label": "parts of the page" });
    for (const [name, title, Kind, isFixed] of PARTS) {
      const body = make("div");
      const section = make("section", { className: `card part part-${name}`, "aria-label": title }, body);
      if (isFixed) section.prepend(make("h2", { textContent: title }));
      section.dataset.part = name;
      section.dataset.fixed = isFixed ? "yes" : "no";
      section.dataset.phone = ON_PHONES.includes(name) ? "fixed" : "tab";
      this.parts.push(new Kind(body, remote, app));
      this.box.append(section);
      if (ON_PHONES.includes(name)) continue;
      const tab = make("button", { type: "button", role: "tab", textContent: title, onclick: () => this.turn(name) });
      tab.dataset.part = name;
      tab.dataset.fixed = isFixed ? "yes" : "no";
      this.nav.append(tab);
    }
    this.box.append(this.nav);
    this.turn("behaviours");
    this.unlisten = hub.listen(key, (robot) => {
      for (const part of this.parts) part.show?.(robot);
    });
  }

  /**
   * Open a tab.
   * @param {string} name
   */
  turn(name) {
    this.box.dataset.tab = name;
    for (const section of this.box.querySelectorAll("section[data-part]"))
      section.classList.toggle("open", /** @type {HTMLElement} */ (section).dataset.part === name);
    for (const tab of this.nav.children)
      tab.setAttribute("aria-selected", String(/** @type {HTMLElement} */ (tab).dataset.part === name));
  }

  close() {
    this.unlisten();
    for (const part of this.parts) part.close?.();
  }
}
