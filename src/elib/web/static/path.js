// Where the robot has been: its trail, and the robot at its end.

import { fit, inks, make, number, say } from "./dom.js";
import { degrees } from "./model.js";

/** @import { Point } from "./robotshape.js" */
/** @import { Known, Pose } from "./hub.js" */

const SCALES = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10];

export class Part {
  /** @param {HTMLElement} box */
  constructor(box) {
    this.news = ""; // tells whether anything is new
    /** @type {Point[]} */
    this.trail = [];
    /** @type {Pose | null} */
    this.pose = null;
    box.classList.add("map");
    this.canvas = make("canvas", { role: "img", "aria-label": "map of the way" });
    this.caption = make("p", { className: "ages", textContent: "x ?  y ?" });
    box.append(this.canvas, this.caption);
    this.watch = new ResizeObserver(() => this.paint());
    this.watch.observe(this.canvas);
  }

  close() {
    this.watch.disconnect();
  }

  /** @param {Known} robot */
  show(robot) {
    const pose = robot.tick.pose,
      news = `${robot.trail.length} ${pose} ${document.documentElement.dataset.theme}`;
    if (news === this.news) return;
    this.news = news;
    this.trail = robot.trail;
    this.pose = pose;
    say(
      this.caption,
      pose ? `x ${number(pose[0], 3)} m   y ${number(pose[1], 3)} m   heading ${degrees(pose[2])}°` : "x ?  y ?",
    );
    this.paint();
  }

  paint() {
    const { pen, width, height } = fit(this.canvas),
      ink = inks("grid", "faint", "accent", "ink");
    /** @type {Point[]} */
    const points = this.pose ? [...this.trail, [this.pose[0], this.pose[1]]] : this.trail;
    if (!points.length) return;
    let [left, right, low, high] = [Infinity, -Infinity, Infinity, -Infinity];
    for (const [x, y] of points) {
      left = Math.min(left, x);
      right = Math.max(right, x);
      low = Math.min(low, y);
      high = Math.max(high, y);
    }
    const scale = Math.min((width - 40) / Math.max(0.2, right - left), (height - 40) / Math.max(0.2, high - low));
    /** @type {(x: number, y: number) => Point} */
    const place = (x, y) => [width / 2 + (x - (left + right) / 2) * scale, height / 2 - (y - (low + high) / 2) * scale];
    const step = SCALES.find((each) => each * scale >= 36) ?? 20;
    pen.strokeStyle = ink.grid;
    pen.lineWidth = 1;
    pen.beginPath();
    for (let x = (width / 2) % (step * scale); x < width; x += step * scale) {
      pen.moveTo(x, 0);
      pen.lineTo(x, height);
    }
    for (let y = (height / 2) % (step * scale); y < height; y += step * scale) {
      pen.moveTo(0, y);
      pen.lineTo(width, y);
    }
    pen.stroke();
    pen.strokeStyle = ink.accent;
    pen.lineWidth = 2;
    pen.lineJoin = pen.lineCap = "round";
    pen.beginPath();
    points.forEach(([x, y]) => pen.lineTo(...place(x, y)));
    pen.stroke();
    pen.fillStyle = ink.faint;
    pen.font = "12px system-ui, sans-serif";
    pen.textAlign = "right";
    pen.fillText(`a square: ${step < 1 ? `${Math.round(100 * step)} cm` : `${step} m`}`, width - 8, height - 8);
    if (this.pose) this.arrow(pen, place(this.pose[0], this.pose[1]), this.pose[2], ink.ink);
  }

  /** @param {CanvasRenderingContext2D} pen @param {Point} place @param {number} heading @param {string} ink */
  arrow(pen, [x, y], heading, ink) {
    pen.save();
    pen.translate(x, y);
    pen.rotate(-heading);
    pen.fillStyle = ink;
    pen.beginPath();
    for (const [ahead, side] of [
      [11, 0],
      [-7, 7],
      [-3, 0],
      [-7, -7],
    ])
      pen.lineTo(ahead, side);
    pen.fill();
    pen.restore();
  }
}
