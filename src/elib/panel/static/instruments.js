// Every reading of the robot with its age, in the robot's own unit and in a common one; some also as a little picture.

import { DIGITS, age, draw, make, number, put, say } from "./dom.js";

/** @import { Instrument, Known, Reading, Scheme } from "./hub.js" */

/** @typedef {(values: Reading["values"], physical: Reading["physical"]) => void} Show */
/** @typedef {{ face: SVGElement, show: Show }} Drawing of a reading */
/** @typedef {[factor: number, unit: string, digits: number]} Conversion */

const MAX_ROWS = 5; // more values stand side by side
/** @type {Record<string, string>} */
const UNITS = { "degrees C": "°C" };

/** @param {Scheme} scheme @returns {Record<string, Conversion | undefined>} from the unit of a reading */
function conversions({ circumference }) {
  return {
    "rev/s": [100 * circumference, "cm/s", 1],
    steps: [circumference / 10, "cm", 1], // a turn has 1000 steps
    rad: [180 / Math.PI, "°", 0],
    T: [1e6, "µT", 1],
  };
}

export class Part {
  /** @param {HTMLElement} box */
  constructor(box) {
    this.box = box;
    /** @type {Map<string, Tile>} */
    this.tiles = new Map();
    /** @type {number | null} */
    this.number = null; // of the scheme that the tiles are made of
    box.classList.add("instruments");
  }

  /** @param {Known} robot */
  show({ tick, scheme }) {
    if (!scheme) return;
    if (scheme.scheme !== this.number) this.build(scheme);
    for (const [name, tile] of this.tiles) tile.show(tick.readings[name]);
  }

  /** @param {Scheme} scheme */
  build(scheme) {
    this.number = scheme.scheme;
    this.tiles.clear();
    const absent = scheme.instruments.filter((each) => each.absent),
      converted = conversions(scheme);
    /** @type {HTMLElement[]} */
    const parts = scheme.instruments
      .filter((each) => !each.absent)
      .map((each) => {
        const tile = new Tile(each, converted);
        this.tiles.set(each.name, tile);
        return tile.box;
      });
    if (absent.length && scheme.firmware)
      parts.push(
        make(
          "details",
          { className: "absent" },
          make("summary", { textContent: `Not on this robot: ${absent.length} sensors` }),
          make(
            "dl",
            {},
            ...absent.flatMap((each) => [
              make("dt", { textContent: each.title }),
              make("dd", { textContent: each.absent }),
            ]),
          ),
        ),
      );
    this.box.replaceChildren(...parts);
  }
}

class Tile {
  /** @param {Instrument} instrument @param {ReturnType<typeof conversions>} converted */
  constructor(instrument, converted) {
    const { labels, units, name, title, physical_unit } = instrument,
      isRing = labels.length > MAX_ROWS;
    this.instrument = instrument;
    this.age = make("span", { className: "age" });
    this.conversions = units.map((unit) => (physical_unit ? undefined : converted[unit]));
    this.rows = labels.map((label, k) => {
      const value = make("b", { textContent: "?" }),
        other = make("span", { className: "other" }),
        unit = physical_unit || this.conversions[k]?.[1] || (UNITS[units[k]] ?? units[k]);
      // A value of a sensor around the robot is named as in the drawing of it.
      const row = make(
        "p",
        { title: isRing ? label : "" },
        make("i", { textContent: isRing ? `IR${k}` : label }),
        value,
      );
      row.append(make("u", { textContent: isRing ? "" : unit }), other);
      return { row, value, other };
    });
    this.picture = PICTURES[name]?.(instrument) ?? null;
    const isWide = isRing || this.picture || this.conversions.some(Boolean) || physical_unit;
    this.box = make(
      "section",
      { className: `tile${isWide ? " wide" : ""}`, "aria-label": title },
      make("h3", {}, isRing ? `${title}, ${units[0]}` : title, this.age),
      make(
        "div",
        { className: "face" },
        this.picture?.face ?? "",
        make("div", { className: isRing ? "values ring" : "values" }, ...this.rows.map(({ row }) => row)),
      ),
    );
  }

  /** @param {Reading | undefined} reading */
  show(reading) {
    const known = reading?.values ?? null;
    this.box.classList.toggle("stale", !reading || reading.stale);
    const isKnown = known?.some((each) => each !== null),
      isKeyless = this.instrument.name === "ir_receiver" && Number(known?.[0]) > 1; // a toggle bit is 0 or 1
    const isOld = isKnown && (reading?.age ?? 0) > 1;
    say(
      this.age,
      isKeyless ? "no key yet" : isOld ? `${age(reading?.age ?? 0)} old` : known && !isKnown ? "no value" : "",
    );
    this.rows.forEach(({ row, value, other }, k) => {
      const unit = this.instrument.units[k],
        found = known?.[k] ?? null,
        conversion = this.conversions[k];
      row.hidden = isKeyless || (known !== null && k >= known.length);
      const own =
        typeof found === "boolean"
          ? found
            ? "yes"
            : "no"
          : number(found, Number.isInteger(found) && unit !== "rev/s" ? 0 : (DIGITS[unit] ?? 0));
      // What is useful is bold; the robot's own number stands beside it.
      const name = this.instrument.physical_unit;
      if (conversion) {
        const [factor, , digits] = conversion;
        say(value, typeof found === "number" ? number(factor * found, digits) : "?");
      } else if (name) say(value, number(reading?.physical?.[k], DIGITS[name] ?? 1));
      else say(value, own);
      say(other, (conversion || name) && found !== null ? `${own} ${UNITS[unit] ?? unit}` : "");
    });
    this.picture?.show(known, reading?.physical ?? null);
  }
}

/** @param {Instrument} instrument @returns {Drawing} */
function bars({ labels, low, high }) {
  const parts = labels.map(() => draw("rect", { x: 0, width: 0, height: 7, rx: 2, class: "bar" }));
  const wide = 56,
    step = Math.min(14, 56 / Math.max(1, labels.length)),
    face = draw("svg", { viewBox: "0 0 56 56", "aria-hidden": "true" });
  const top = 28 - (step * labels.length) / 2;
  parts.forEach((bar, k) => {
    put(bar, "y", top + k * step + (step - 7) / 2);
    face.append(
      draw("rect", { x: 0, y: top + k * step + (step - 7) / 2, width: wide, height: 7, rx: 2, class: "groove" }),
      bar,
    );
  });
  return {
    face,
    show: (values) =>
      parts.forEach((bar, k) => {
        const value = Number(values?.[k] ?? 0),
          least = low ?? 0;
        put(bar, "width", value ? Math.max(0, Math.min(wide, (wide * (value - least)) / ((high ?? 4095) - least))) : 0);
      }),
  };
}

/**
 * An attitude: the bubble goes to the side that is up, and lies in the middle of a robot that stands level.
 * @returns {Drawing}
 */
function bubble() {
  const dot = draw("circle", { r: 7, class: "bubble" });
  const face = draw(
    "svg",
    { viewBox: "-28 -28 56 56", "aria-hidden": "true" },
    draw("circle", { r: 27, class: "dish" }),
    draw("circle", { r: 9, class: "groove-line" }),
    draw("path", { d: "M-27,0H27M0,-27V27", class: "groove-line" }),
    dot,
  );
  return {
    face,
    show(values, physical) {
      const [x, y, z] = physical?.every((each) => each !== null) ? /** @type {number[]} */ (physical) : [0, 0, 1],
        far = Math.max(0.3, Math.hypot(x, y, z));
      put(dot, "cx", ((-20 * x) / far).toFixed(1));
      put(dot, "cy", ((20 * y) / far).toFixed(1));
      dot.classList.toggle("over", z < 0);
    },
  };
}

/** @returns {Drawing} */
function dial() {
  const hand = draw("path", { d: "M0,4V-19", class: "hand" }),
    ticks = Array.from({ length: 16 }, (_, k) =>
      draw("path", { d: "M0,-26V-22", class: "groove-line", transform: `rotate(${22.5 * k})` }),
    );
  return {
    face: draw("svg", { viewBox: "-28 -28 56 56", "aria-hidden": "true" }, ...ticks, hand),
    show: (values) => put(hand, "transform", `rotate(${22.5 * Number(values?.[0] ?? 0)})`),
  };
}

/** @type {Record<string, (instrument: Instrument) => Drawing>} */
const PICTURES = { accelerometer: bubble, microphones: bars, ground: bars, selector: dial };
