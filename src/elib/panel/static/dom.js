// Small things that every part needs. All text goes in as text: nothing here reads HTML.

const SVG = "http://www.w3.org/2000/svg";
// What takes keys for itself: letters, and what takes only arrow keys.
const TAKES_KEYS = "textarea, select, [contenteditable=true], [data-keys], [role=listbox], dialog";
const TAKES_ARROWS = "input[type=range], input[type=radio], [role=tab]";

/** @import { Answer } from "./connection.js" */

/**
 * A robot, as a part of its page speaks to it.
 * @typedef {object} Remote
 * @property {string} key of the robot
 * @property {() => string} page the name of this page, where it says who drives
 * @property {(what: string, values?: object) => void} tell sends something that needs no answer
 * @property {(what: string, values?: object) => Promise<Answer>} ask sends a request; an error is shown to the person
 */

/**
 * Make an element; attributes that are properties of it are set as such.
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Record<string, any>} attributes
 * @param {...(Node | string)} children
 */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name in element && name !== "list") Object.assign(element, { [name]: value });
    else element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

/**
 * Make a button. While what it asks for waits for an answer, it says so, and asks for nothing more.
 * @param {string} text
 * @param {() => unknown} act
 * @param {Record<string, any>} [attributes]
 */
export function button(text, act, attributes = {}) {
  const made = make("button", { type: "button", className: "plain", textContent: text, ...attributes });
  made.addEventListener("click", () => {
    if (made.getAttribute("aria-busy") !== "true") pending(made, Promise.resolve(act()));
  });
  return made;
}

/**
 * Make an element of a drawing.
 * @template {keyof SVGElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Record<string, string | number>} attributes
 * @param {...(Node | string)} children
 */
export function draw(tag, attributes = {}, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  element.append(...children);
  return element;
}

/**
 * Change a text, but only if it is another.
 * @param {Element} element
 * @param {string | null} text
 */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** @param {Element} element @param {string} name @param {string | number | boolean} value */
export function put(element, name, value) {
  const text = String(value);
  if (element.getAttribute(name) !== text) element.setAttribute(name, text);
}

/**
 * A number for a person: `digits` after the point, a true minus, no minus before nothing.
 * @param {number | null | undefined} value
 * @param {number} digits
 */
export function number(value, digits = 0) {
  if (value === null || value === undefined) return "?";
  const text = !Number.isInteger(value) || digits ? value.toFixed(digits) : String(value);
  return text.replace(/^-(?=0(\.0*)?$)/, "").replace("-", "−");
}

/**
 * How many digits after the point make sense for a unit.
 * @type {Record<string, number>}
 */
export const DIGITS = { "rev/s": 2, g: 2, "rad/s": 2, rad: 2, V: 2, m: 3, T: 7 };

/** @param {number | null} seconds */
export function age(seconds) {
  if (seconds === null) return "";
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 100) return `${Math.round(seconds)} s`;
  return seconds < 6000 ? `${Math.round(seconds / 60)} min` : `${Math.round(seconds / 3600)} h`;
}

/** @param {number} count */
export function bytes(count) {
  if (count < 1000) return `${count} B`;
  return count < 1e6 ? `${(count / 1e3).toFixed(0)} kB` : `${(count / 1e6).toFixed(1)} MB`;
}

/**
 * The colours of the page, by their names in style.css.
 * @param {...string} names
 * @returns {Record<string, string>}
 */
export function inks(...names) {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

/**
 * A canvas that is as sharp as the screen; `pen` draws in CSS pixels.
 * @param {HTMLCanvasElement} canvas
 */
export function fit(canvas) {
  const density = Math.min(3, window.devicePixelRatio || 1),
    { clientWidth: width, clientHeight: height } = canvas;
  const [across, down] = [Math.max(1, Math.round(width * density)), Math.max(1, Math.round(height * density))];
  if (canvas.width !== across || canvas.height !== down) [canvas.width, canvas.height] = [across, down];
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.setTransform(density, 0, 0, density, 0, 0);
  pen.clearRect(0, 0, width, height);
  return { pen, width, height };
}

/**
 * Whether a key belongs to what has the focus, as in a field one writes in or a list one chooses from.
 * @param {EventTarget | null} target
 * @param {boolean} isArrow it is an arrow key
 */
export function isBusy(target, isArrow) {
  if (!(target instanceof Element)) return false;
  return isWriting(target) || target.closest(isArrow ? `${TAKES_KEYS}, ${TAKES_ARROWS}` : TAKES_KEYS) !== null;
}

/**
 * Whether somebody writes there.
 * @param {EventTarget | null} target
 */
export function isWriting(target) {
  if (!(target instanceof Element)) return false;
  if (target.closest("textarea, [contenteditable=true]")) return true;
  return target instanceof HTMLInputElement && !["checkbox", "radio", "range", "button"].includes(target.type);
}

/** Stop what the page shows, as its STOP does. */
export const pleaseStop = () => document.dispatchEvent(new CustomEvent("elib-please-stop"));

/**
 * Ask a person; returns whether they want it.
 * @param {string} title
 * @param {string} text
 * @param {string} yes what the button says that does it
 * @param {...HTMLElement} fields what has to be filled in for it
 * @returns {Promise<boolean>}
 */
export function confirmed(title, text, yes, ...fields) {
  return new Promise((resolve) => {
    const dialog = make(
      "dialog",
      { className: "card", "aria-label": title },
      make("h3", { textContent: title }),
      make("p", { textContent: text }),
      make(
        "form",
        { method: "dialog" },
        ...fields,
        make(
          "div",
          { className: "row" },
          make("button", { className: "primary", value: "yes", textContent: yes }),
          make("button", { className: "plain", value: "no", textContent: "Cancel", formNoValidate: true }),
          // The one of the header cannot be reached while this is open.
          make("button", { type: "button", className: "stop small", textContent: "STOP", onclick: pleaseStop }),
        ),
      ),
    );
    dialog.addEventListener("close", () => {
      dialog.remove();
      resolve(dialog.returnValue === "yes");
    });
    document.body.append(dialog);
    dialog.showModal();
  });
}

/**
 * Show on a control that its request waits for an answer, until that has come.
 * @template Result
 * @param {Element} control
 * @param {Promise<Result>} work
 * @returns {Promise<Result>}
 */
export async function pending(control, work) {
  control.setAttribute("aria-busy", "true");
  try {
    return await work;
  } finally {
    control.removeAttribute("aria-busy");
  }
}

/**
 * Let the browser save a file.
 * @param {Blob} blob
 * @param {string} name
 */
export function store(blob, name) {
  const link = make("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
