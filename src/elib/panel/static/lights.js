// What a click makes a robot show and play: lights, the colours of the e-puck2, and sounds.

import { button, make, pending, put, say } from "./dom.js";

/** @import { Remote } from "./dom.js" */
/** @import { Known } from "./hub.js" */

const ALL_LEDS = 8; // the number that means all of them
const STOP_SOUND = 0;
const COLOURED = [1, 3, 5, 7]; // LEDs of the e-puck2
const SOUNDS = {
  epuck1: ["haa", "spaah", "ouah", "yaouh", "wouaaaaaaaah"],
  epuck2: ["Mario", "Underworld", "Star Wars", "4 kHz", "10 kHz"],
};

export class Part {
  /** @param {HTMLElement} box @param {Remote} robot */
  constructor(box, robot) {
    this.robot = robot;
    this.box = box;
    box.classList.add("lights");
    /** @type {(name: string, ...values: number[]) => Promise<unknown>} */
    const command = (name, ...values) => robot.ask("command", { name, arguments: values });
    /** @type {(text: string, name: string) => HTMLButtonElement} */
    const toggle = (text, name) => {
      const made = button(text, () => command(name, Number(made.getAttribute("aria-pressed") !== "true")));
      return made;
    };
    this.body = toggle("Body", "set_body_led");
    this.front = toggle("Front", "set_front_led");
    this.sounds = SOUNDS.epuck1.map((_, index) => button("", () => command("play_sound", index + 1)));
    this.colours = COLOURED.map((led) => {
      const input = make("input", { type: "color", value: "#000000", "aria-label": `colour of LED${led}` });
      input.addEventListener("change", () => {
        const shares = [1, 3, 5].map(
          (at) => Math.round((100 * parseInt(input.value.slice(at, at + 2), 16)) / 255) / 100,
        );
        pending(input, command("set_rgb_led", led, ...shares));
      });
      return input;
    });
    /** @type {(label: string, name: string, ...controls: Node[]) => HTMLElement} */
    const group = (label, name, ...controls) =>
      make(
        "div",
        { role: "group", "aria-label": label },
        make("span", { className: "name", textContent: name }),
        make("div", { className: "row wrap" }, ...controls),
      );
    this.coloured = group(
      "colours",
      "Colours",
      ...this.colours.map((input, k) => make("label", { className: "check" }, String(COLOURED[k]), input)),
    );
    this.coloured.title = "of LED1, LED3, LED5 and LED7";
    box.append(
      group(
        "lights",
        "LEDs",
        button("All on", () => command("set_led", ALL_LEDS, 1), { "aria-label": "all ring LEDs on" }),
        button("All off", () => command("set_led", ALL_LEDS, 0), { "aria-label": "all ring LEDs off" }),
        this.body,
        this.front,
      ),
      this.coloured,
      group(
        "sounds",
        "Sounds",
        ...this.sounds,
        button("Stop sound", () => command("play_sound", STOP_SOUND)),
      ),
    );
  }

  /** @param {Known} robot */
  show({ tick, scheme }) {
    const isOn = tick.phase === "connected",
      { lamps } = tick;
    for (const control of this.box.querySelectorAll("button, input"))
      /** @type {HTMLButtonElement} */ (control).disabled = !isOn;
    put(this.body, "aria-pressed", Boolean(lamps.body));
    put(this.front, "aria-pressed", Boolean(lamps.front));
    const names = scheme?.firmware.startsWith("epuck2") ? SOUNDS.epuck2 : SOUNDS.epuck1;
    this.sounds.forEach((sound, index) => {
      say(sound, names[index]);
      put(sound, "aria-label", `play sound ${index + 1}, ${names[index]}`);
    });
    this.coloured.hidden = !lamps.rgb;
    this.colours.forEach((input, index) => {
      /** @type {HTMLElement} */ (input.parentElement).hidden = COLOURED[index] === scheme?.status_led;
      const colour = lamps.rgb?.[index];
      if (!colour || input.getAttribute("aria-busy") || input === document.activeElement) return;
      const bytes = colour.map((share) => Math.round(2.55 * share).toString(16));
      input.value = `#${bytes.map((byte) => byte.padStart(2, "0")).join("")}`;
      put(input, "data-off", !colour.some(Boolean));
      input.title = `LED${COLOURED[index]}: ${colour.some(Boolean) ? "on" : "off"}`;
    });
  }
}
