// Light and dark: as the system has it, until somebody chooses.

import { make } from "./dom.js";

export class Part {
  /** @param {HTMLElement} box */
  constructor(box) {
    this.system = matchMedia("(prefers-color-scheme: dark)");
    this.follow = () => {
      if (!localStorage.getItem("elib-theme")) this.dress(this.system.matches);
    };
    this.system.addEventListener("change", this.follow);
    box.append(
      make(
        "button",
        {
          type: "button",
          className: "plain",
          "aria-label": "switch between light and dark",
          onclick: () => this.flip(),
        },
        make("span", { textContent: "◐", "aria-hidden": "true" }),
      ),
    );
    this.dress(document.documentElement.dataset.theme === "dark");
  }

  close() {
    this.system.removeEventListener("change", this.follow);
  }

  flip() {
    const isDark = document.documentElement.dataset.theme !== "dark";
    localStorage.setItem("elib-theme", isDark ? "dark" : "light");
    this.dress(isDark);
  }

  /** @param {boolean} isDark */
  dress(isDark) {
    document.documentElement.dataset.theme = isDark ? "dark" : "light";
    // @ts-expect-error: NiceGUI's page has Quasar as a global.
    Quasar.Dark.set(isDark);
  }
}
