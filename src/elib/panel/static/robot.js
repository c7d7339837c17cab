// The robot from above, its front upwards: what its infrared sensors see, by name, and its LEDs, which can be clicked.

import { age, draw, make, number, pending, put, say } from "./dom.js";

/** @import { Point } from "./robotshape.js" */
/** @import { App } from "./app.js" */
/** @import { Remote } from "./dom.js" */
/** @import { Known, Lamps, Reading } from "./hub.js" */

export const SENSOR_NAMES = [
  "front right",
  "diagonal right",
  "right",
  "rear right",
  "rear left",
  "left",
  "diagonal left",
  "front left",
];
const RADIUS = 60,
  REACH = 46,
  FAR = 6; // pixels of the drawing, pixels, and cm: the server gives no greater distance
const FULL = 4095;

/** @type {(degrees: number, radius: number) => Point} */
const at = (degrees, radius) => {
  const turn = (degrees * Math.PI) / 180;
  return [-radius * Math.sin(turn), -radius * Math.cos(turn)];
};

/** @type {(reading: Reading | undefined, sensor: number) => number | null} */
const countsOf = (reading, sensor) => /** @type {number | null} */ (reading?.values?.[sensor] ?? null);

/** @param {number} degrees @param {number} from @param {number} to @param {number} half */
function wedge(degrees, from, to, half) {
  const corners = [
    [-half, from],
    [-half, to],
    [half, to],
    [half, from],
  ];
  const points = corners.map(([side, radius]) => at(degrees + side, radius).map((v) => v.toFixed(1)));
  return `M${points[0]}L${points[1]}A${to},${to} 0 0 0 ${points[2]}L${points[3]}A${from},${from} 0 0 1 ${points[0]}Z`;
}

/** @typedef {ReturnType<Part["beam"]>} Beam */

/** @param {number} angle rad */
const inDegrees = (angle) => (angle * 180) / Math.PI;

export class Part {
  /** @param {HTMLElement} box @param {Remote} robot @param {App} app */
  constructor(box, robot, app) {
    this.box = box;
    this.robot = robot;
    const { sensors, leds } = app.hello?.ring ?? { sensors: [], leds: [] };
    this.sensors = sensors.map(inDegrees); // from straight ahead, positive to the left
    this.leds = leds.map(inDegrees);
    /** @type {Map<string, SVGElement>} */
    this.lamps = new Map();
    /** @type {SVGElement[]} */
    this.arrows = [];
    box.classList.add("robot");
    const face = draw("svg", {
      viewBox: "-143 -136 286 262",
      role: "group",
      "aria-label": "the robot from above, its front upwards",
    });
    this.beams = SENSOR_NAMES.map((_, sensor) => this.beam(sensor));
    face.append(...this.beams.map((beam) => beam.face), ...this.body());
    for (let led = 0; led < 8; led++)
      face.append(this.lamp(`ring ${led}`, `LED ${led}`, ...at(this.leds[led], 50), 8, ["set_led", led]));
    face.append(
      this.lamp("body", "body light", 0, 12, 20, ["set_body_led"]),
      this.lamp("front", "front LED", ...at(-24, 63), 6, ["set_front_led"]),
    );
    this.ages = make("p", { className: "ages" });
    const legend = "IR0 to IR7: infrared, in counts and cm. 0 to 7: LEDs, click to switch.";
    box.replaceChildren(face, make("p", { className: "hint", textContent: legend }), this.ages);
  }

  /** @param {number} sensor */
  beam(sensor) {
    const turn = this.sensors[sensor],
      [x, y] = at(turn, RADIUS + REACH + 17);
    const beam = {
      title: draw("title"),
      wall: draw("path", { class: "near" }),
      count: draw("text", { x, y, class: "count" }),
      far: draw("text", { x, y: y + 12, class: "far" }),
      lightTitle: draw("title"),
      light: draw("path", { d: wedge(turn, 33, 39, 11), class: "light" }),
    };
    beam.light.append(beam.lightTitle);
    const free = draw("path", { d: wedge(turn, RADIUS + 5, RADIUS + REACH, 8), class: "beam" }),
      name = draw("text", { x, y: y - 12, class: "far" }, `IR${sensor}`);
    const face = draw("g", { role: "img", class: "sensor" }, beam.title, free, beam.wall, name, beam.count, beam.far);
    return { ...beam, face };
  }

  body() {
    /** @type {(side: number) => SVGElement} */
    const wheel = (side) =>
      draw("rect", { x: side < 0 ? -53 : 43, y: -21, width: 10, height: 42, rx: 3, class: "tyre" });
    this.arrows = [-1, 1].map((side) => draw("path", { class: "speed", transform: `translate(${48 * side} 0)` }));
    return [
      draw("circle", { r: RADIUS, class: "rim" }),
      draw("circle", { r: RADIUS - 3, class: "shell" }),
      wheel(-1),
      wheel(1),
      ...this.arrows,
      draw("circle", { r: 41, class: "board" }),
      ...this.beams.map((beam) => beam.light),
      draw("path", { d: "M0,-30 L9,-12 L0,-17 L-9,-12 Z", class: "nose" }),
    ];
  }

  /**
   * @param {string} key
   * @param {string} name
   * @param {number} x
   * @param {number} y
   * @param {number} size
   * @param {[name: string, ...values: number[]]} what the command, without its last argument
   */
  lamp(key, name, x, y, size, what) {
    const group = draw(
      "g",
      {
        role: "switch",
        tabindex: 0,
        "aria-label": name,
        "aria-checked": "false",
        class: `lamp ${key.split(" ")[0]}`,
        transform: `translate(${x.toFixed(1)} ${y.toFixed(1)})`,
      },
      draw("title", {}, name),
      draw("circle", { r: Math.max(size + 3, 12), class: "touch" }),
      draw("circle", { r: 1.75 * size, class: "glow" }),
      draw("circle", { r: size, class: "glass" }),
      draw("text", { y: 0.5 }, /\d$/.test(name) ? name.slice(-1) : ""),
    );
    const flip = () => {
      if (group.getAttribute("aria-busy") === "true") return;
      const isOn = group.getAttribute("aria-checked") === "true",
        [command, ...values] = what;
      pending(group, this.robot.ask("command", { name: command, arguments: [...values, Number(!isOn)] }));
    };
    group.addEventListener("click", flip);
    group.addEventListener("keydown", (event) => {
      if (event.key === "Enter") flip(); // Space stops the robot
    });
    this.lamps.set(key, group);
    return group;
  }

  /** @param {Known} robot */
  show({ tick, scheme }) {
    const { proximity, ambient_light: light } = tick.readings;
    this.box.dataset.off = tick.phase === "connected" || tick.phase === "playing" ? "no" : "yes";
    this.beams.forEach((beam, sensor) => this.showBeam(beam, sensor, proximity, tick.distances[sensor], light));
    /** @type {Lamps} */
    const lamps = tick.lamps ?? { ring: Array(8).fill(0), body: 0, front: 0 };
    lamps.ring.forEach((on, led) =>
      this.light(`ring ${led}`, on, lamps.rgb && led % 2 ? lamps.rgb[(led - 1) / 2] : null),
    );
    this.light("body", lamps.body);
    this.light("front", lamps.front);
    const fastest = scheme?.fastest ?? 1;
    this.arrows.forEach((arrow, wheel) => {
      const long = (38 * (wheel ? tick.drive.right : tick.drive.left)) / fastest,
        head = Math.sign(long) * 5;
      put(arrow, "d", Math.abs(long) < 1 ? "" : `M0,0V${(-long).toFixed(1)}m-4,${head}l4,${-head}l4,${head}`);
    });
    /** @type {(reading: Reading | undefined, name: string) => string} */
    const told = (reading, name) =>
      reading?.values && (reading.age ?? 0) > 1 ? `${name}: ${age(reading.age)} old` : "";
    say(this.ages, [told(proximity, "Infrared"), told(light, "inner ring")].filter(Boolean).join(" · "));
    this.ages.classList.toggle("stale", Boolean(proximity?.stale));
  }

  /**
   * @param {Beam} beam
   * @param {number} sensor
   * @param {Reading | undefined} proximity
   * @param {number | null} metres
   * @param {Reading | undefined} light
   */
  showBeam(beam, sensor, proximity, metres, light) {
    const counts = countsOf(proximity, sensor),
      far = metres === null ? Infinity : 100 * metres,
      isNear = Number.isFinite(far),
      share = far / FAR,
      from = RADIUS + 5 + share * (REACH - 12),
      stale = proximity?.stale ? "stale" : "",
      name = SENSOR_NAMES[sensor];
    put(beam.wall, "d", isNear ? wedge(this.sensors[sensor], from, from + 10 - 5 * share, 8 - 3 * share) : "");
    put(beam.wall, "class", `near ${stale || (far < 2 ? "close" : far < 5 ? "middle" : "")}`);
    put(beam.count, "class", `count ${stale}`);
    say(beam.count, number(counts));
    say(beam.far, isNear ? `${far.toFixed(1)} cm` : "");
    const about = isNear ? `about ${far.toFixed(1)} cm` : `nothing within ${FAR} cm`;
    say(beam.title, `IR${sensor}, ${name}: ${counts === null ? "unknown" : `${counts} counts, ${about}`}`);
    const dark = countsOf(light, sensor);
    put(
      beam.light,
      "fill-opacity",
      dark === null || light?.stale ? 0 : (0.1 + 0.9 * (1 - Math.min(1, dark / FULL))).toFixed(2),
    );
    say(beam.lightTitle, `light ${name}: ${dark === null ? "unknown" : `${dark} counts, higher is darker`}`);
  }

  /** @param {string} key @param {number} on @param {number[] | null} [colour=null] */
  light(key, on, colour = null) {
    const group = this.lamps.get(key);
    if (!group) return;
    put(group, "aria-checked", on ? "true" : "false");
    // Ten percent are bright to the eye already.
    const most = Math.max(1, ...(colour ?? [])),
      scale = (1.5 * (100 + most / 1.43)) / most;
    if (on && colour) group.style.setProperty("--lit", `rgb(${colour.map((share) => Math.round(scale * share))})`);
    else group.style.removeProperty("--lit");
  }
}
