// All robots at a glance, with their world.

import { make } from "./dom.js";

/** @import { App } from "./app.js" */

export class OverviewPlace {
  /** @param {App} app */
  constructor(app) {
    this.app = app;
    this.box = make("div", { className: "overview-place" }, "All robots");
  }

  close() {}
}
