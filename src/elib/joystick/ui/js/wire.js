// Tells the server how far the page has come: it sends no more to a page that does not keep up.

import { hub } from "./hub.js";

/** @import { Emit } from "./dom.js" */

const EVERY = 4; // messages for one answer
const LATER = ["chart", "console", "events", "play", "source", "world", "overview"]; // fetched while nobody waits for them

export class Part {
  /** @param {HTMLElement} box @param {object} options @param {Emit} emit */
  constructor(box, options, emit) {
    /** @type {(name: string, number: number) => void} */
    this.answer = (name, number) => {
      if (number % EVERY === 0) emit(name, { number });
    };
    hub.emit = this.answer;
    setTimeout(() => LATER.forEach((kind) => import(`elib-joystick/${kind}.js`).catch(() => {})), 500);
  }

  close() {
    if (hub.emit === this.answer) hub.emit = null;
  }
}
