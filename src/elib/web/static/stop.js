// STOP: always on the page, and under the space bar. It asks nobody and waits for nothing.

import { isWriting, make, say } from "./dom.js";
import { hub } from "./hub.js";

/** @import { Emit } from "./dom.js" */
/** @import { Known } from "./hub.js" */

const CONTROLS =
  "button, a, summary, input, select, [role=switch], [role=button], [role=tab], [role=option], [role=checkbox]";

export class Part {
  /** @param {HTMLElement} box @param {{ text: string }} options @param {Emit} emit */
  constructor(box, options, emit) {
    this.emit = emit;
    this.mayMove = false;
    this.isDown = false; // the space that stopped
    /** @type {string | null} */
    this.steps = null; // of the wheels, as read last; the first reading is always another
    this.turned = -Infinity; // when they were others
    /** @type {(() => void) | null} */
    this.deaf = null;
    this.button = make("button", { type: "button", className: "stop", onclick: () => this.stop() });
    this.button.setAttribute("aria-keyshortcuts", "Space");
    this.text = make("span", { textContent: options.text });
    this.button.append(this.text, make("kbd", { textContent: "space" }));
    box.append(this.button);
    this.onKey = (/** @type {KeyboardEvent} */ event) => this.press(event);
    this.onAsk = () => this.stop();
    this.onKeyUp = (/** @type {KeyboardEvent} */ event) => this.release(event);
    window.addEventListener("keydown", this.onKey, true);
    window.addEventListener("keyup", this.onKeyUp, true);
    document.addEventListener("elib-please-stop", this.onAsk);
  }

  close() {
    this.deaf?.();
    window.removeEventListener("keydown", this.onKey, true);
    window.removeEventListener("keyup", this.onKeyUp, true);
    document.removeEventListener("elib-please-stop", this.onAsk);
  }

  stop() {
    window.dispatchEvent(new CustomEvent("elib-stop"));
    this.emit("stop", {});
    this.button.classList.add("pressed");
    setTimeout(() => this.button.classList.remove("pressed"), 250);
  }

  /**
   * Space stops, unless somebody writes; a control keeps its own space only while the robot stands. One that sets the
   * robot in motion has none: Enter presses it.
   * @param {KeyboardEvent} event
   */
  press(event) {
    if (event.code !== "Space" || event.ctrlKey || event.metaKey || event.altKey || isWriting(event.target)) return;
    const control =
      event.target instanceof Element ? /** @type {HTMLElement | null} */ (event.target.closest(CONTROLS)) : null;
    if (!this.mayMove && control && !("drives" in control.dataset)) return;
    event.preventDefault();
    event.stopPropagation();
    this.isDown = true;
    if (!event.repeat) this.stop();
  }

  /**
   * The space that stopped is no click when it comes up again, either: Firefox would make it one.
   * @param {KeyboardEvent} event
   */
  release(event) {
    if (event.code !== "Space" || !this.isDown) return;
    this.isDown = false;
    event.preventDefault();
    event.stopPropagation();
  }

  /**
   * It stands only where everything says so: what it was told last, who is at the stick, and its own wheels.
   * @param {Known} robot
   */
  show({ tick }) {
    const steps = String(tick.readings.encoders?.values ?? "");
    if (steps !== this.steps) this.turned = tick.time; // the speed it was asked for says nothing: it outlives a stop
    this.steps = steps;
    this.mayMove = tick.drive.may_move || tick.drive.driver !== "" || tick.time - this.turned < 0.5;
  }

  /**
   * Stop another robot from now on, by its key; all of them, if it is empty.
   * @param {string} key
   * @param {string} text
   */
  attend(key, text) {
    this.deaf?.();
    this.deaf = key ? hub.listen(key, (robot) => this.show(robot)) : null;
    this.mayMove = !key; // of several robots one may always move
    say(this.text, text);
  }
}
