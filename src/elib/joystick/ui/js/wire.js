// Tells the server how far the page has come: it sends no more to a page that does not keep up.

import { hub } from "./hub.js";

const EVERY = 4; // messages for one answer
const LATER = ["chart", "console", "events", "play", "source", "world", "overview"]; // fetched while nobody waits for them

export class Part {
  constructor(box, options, emit) {
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
