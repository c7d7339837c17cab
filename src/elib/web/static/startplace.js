// The start page: a robot is chosen by its URL, from those that were found or used before, or from the virtual worlds.

import { make } from "./dom.js";

/** @import { App } from "./app.js" */

export class StartPlace {
  /** @param {App} app */
  constructor(app) {
    this.box = make("div", { className: "start" });
    const url = make("input", { type: "text", "aria-label": "URL of the robot", placeholder: "serial:///dev/rfcomm0" });
    this.box.append(
      make(
        "form",
        {
          onsubmit: (/** @type {Event} */ event) => {
            event.preventDefault();
            app.add(url.value.trim());
          },
        },
        url,
        make("button", { className: "primary", textContent: "Connect" }),
      ),
    );
  }

  close() {}
}
