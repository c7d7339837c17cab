// Where a robot without a virtual world has been, and what its infrared sensors have met on the way: an occupancy sketch.

import { fit, inks, make, number, say } from "./dom.js";
import { degrees } from "./model.js";
import { drawRobot, grid, line, paint, stepOf } from "./robotshape.js";

/** @import { App } from "./app.js" */
/** @import { Known, Pose } from "./hub.js" */
/** @import { Point } from "./robotshape.js" */

const CELL = 0.01; // m, the side of a square of the sketch
const RIM = 0.035; // m from the middle of the robot to its sensors
const SIGHT = 0.05; // m: what a sensor that meets nothing has seen to be free
const WALL = 0.03; // m between the middle and a robot's rim, and a little: where it stands is free
const SURE = 6; // readings after which a square cannot become surer
const MAX_CELLS = 40_000;
const MEANINGS = [
  ["wall", "something there"],
  ["free", "free"],
  ["unseen", "not seen yet"],
];
const UNKNOWN = "Connect the robot: its path and what it sees are drawn here.";

export class Part {
  /** @param {HTMLElement} box @param {App} app */
  constructor(box, app) {
    const { sensors, leds } = app.hello?.ring ?? { sensors: [], leds: [] };
    this.angles = sensors;
    this.leds = leds;
    this.news = ""; // tells whether anything is new
    /** @type {Point[]} */
    this.trail = [];
    /** @type {Pose | null} */
    this.pose = null;
    /** @type {Map<string, number>} */
    this.cells = new Map(); // of the sketch: above 0 something is there, below 0 nothing is
    this.box = box;
    box.classList.add("map", "unknown");
    this.canvas = make("canvas", { role: "img", "aria-label": "path of the robot, and what its sensors have met" });
    this.caption = make("p", { className: "ages", textContent: UNKNOWN });
    const legend = make("p", { className: "map-legend" });
    for (const [kind, text] of MEANINGS) legend.append(make("i", { className: kind, "aria-hidden": "true" }), text);
    box.append(this.canvas, this.caption, legend);
    this.watch = new ResizeObserver(() => this.paint());
    this.watch.observe(this.canvas);
  }

  close() {
    this.watch.disconnect();
  }

  /** @param {Known} robot */
  show(robot) {
    const pose = robot.tick.pose,
      near = robot.tick.readings.proximity;
    if (robot.tick.trail?.whole && robot.trail.length < 2) this.cells.clear(); // another journey
    if (pose && near?.values && !near.stale) this.sketch(pose, robot.tick.distances);
    const news = `${robot.trail.length} ${pose} ${near?.values} ${document.documentElement.dataset.theme}`;
    if (news === this.news) return;
    this.news = news;
    this.box.classList.toggle("unknown", !pose);
    this.trail = robot.trail;
    this.pose = pose;
    say(
      this.caption,
      pose ? `x ${number(pose[0], 3)} m   y ${number(pose[1], 3)} m   heading ${degrees(pose[2])}°` : UNKNOWN,
    );
    this.paint();
  }

  /**
   * Note what the sensors see now.
   * @param {Pose} pose
   * @param {(number | null)[]} distances
   */
  sketch([x, y, heading], distances) {
    if (this.cells.size > MAX_CELLS) return;
    this.mark(x, y, -SURE);
    distances.forEach((metres, sensor) => {
      if (this.angles[sensor] === undefined) return;
      const far = metres ?? Infinity,
        angle = heading + this.angles[sensor];
      const [cosine, sine] = [Math.cos(angle), Math.sin(angle)];
      for (let along = WALL; along < RIM + Math.min(far, SIGHT) - CELL; along += CELL)
        this.mark(x + along * cosine, y + along * sine, -1);
      if (far < SIGHT) this.mark(x + (RIM + far) * cosine, y + (RIM + far) * sine, 2);
    });
  }

  /** @param {number} x @param {number} y @param {number} weight */
  mark(x, y, weight) {
    const key = `${Math.floor(x / CELL)} ${Math.floor(y / CELL)}`;
    this.cells.set(key, Math.max(-SURE, Math.min(SURE, (this.cells.get(key) ?? 0) + weight)));
  }

  paint() {
    const { pen, width, height } = fit(this.canvas),
      ink = inks("line", "faint", "accent", "ink", "floor", "edge");
    /** @type {Point[]} */
    const points = this.pose ? [...this.trail, [this.pose[0], this.pose[1]]] : this.trail;
    if (!points.length || Math.min(width, height) < 60) return; // it may be hidden
    let [left, right, low, high] = [Infinity, -Infinity, Infinity, -Infinity];
    for (const [x, y] of points) {
      left = Math.min(left, x - 0.1);
      right = Math.max(right, x + 0.1);
      low = Math.min(low, y - 0.1);
      high = Math.max(high, y + 0.1);
    }
    const scale = Math.min((width - 40) / (right - left), (height - 40) / (high - low));
    /** @type {(x: number, y: number) => Point} */
    const place = (x, y) => [width / 2 + (x - (left + right) / 2) * scale, height / 2 - (y - (low + high) / 2) * scale];
    for (const [key, weight] of this.cells) {
      const [column, row] = key.split(" ").map(Number);
      const [cellLeft, cellTop] = place(column * CELL, (row + 1) * CELL);
      pen.globalAlpha = weight > 0 ? 0.2 + (0.8 * weight) / SURE : 1;
      pen.fillStyle = weight > 0 ? ink.ink : ink.floor;
      if (weight) pen.fillRect(cellLeft, cellTop, CELL * scale + 0.6, CELL * scale + 0.6);
    }
    pen.globalAlpha = 1;
    const step = stepOf(scale, 36);
    grid(pen, step * scale, place(0, 0), [0, 0], [width, height]);
    paint(pen, "", ink.line, 1);
    pen.lineJoin = pen.lineCap = "round";
    line(pen, ...points.map((point) => place(...point)));
    paint(pen, "", ink.accent);
    pen.fillStyle = ink.faint;
    pen.font = "12px system-ui, sans-serif";
    pen.textAlign = "right";
    pen.fillText(`a square: ${step < 1 ? `${Math.round(100 * step)} cm` : `${step} m`}`, width - 8, height - 8);
    if (!this.pose) return;
    const [x, y, heading] = this.pose;
    drawRobot(pen, [...place(x, y), heading], Math.max(8, RIM * scale), ink.edge, this.leds);
  }
}
