// The canvas: arena, things, robots. It draws what the model holds, once for each frame.

import { inks } from "./dom.js";
import { CUT, HUES, drawRays, drawRobot } from "./robotshape.js";

/** @import { Model, Thing } from "./model.js" */
/** @import { Pen, Point } from "./robotshape.js" */
/** @import { Box, Cylinder, Frame, Light, Scene, Sound } from "./frames.js" */

/** @type {(value: number, low: number, high: number) => number} */
const between = (value, low, high) => Math.max(low, Math.min(high, value));

const GRID = [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200]; // m
const LABELS = 64; // pixels between two numbers at the edge, at least
const PALE = 8; // steps from an old trail to a new one
const MARGIN = { left: 32, right: 10, top: 10, bottom: 26 }; // pixels around the arena, for the scale
const CLOSEST = 40; // times as large as the whole arena

/** @param {HTMLCanvasElement} canvas */
function penOf(canvas) {
  return /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
}

export class Arena {
  /** @param {HTMLCanvasElement} canvas @param {Model} model */
  constructor(canvas, model) {
    this.canvas = canvas;
    this.model = model;
    /** @type {Thing | null} */
    this.selected = null;
    /** @type {number | null} */
    this.followed = null; // the robot that stays in the middle
    this.zoom = 1; // 1 shows the whole arena
    this.middle = [0, 0]; // of what is in view, m
    /** @type {HTMLImageElement | null} */
    this.floor = null;
    // Of the page, in its pixels; fit() knows them.
    this.density = 1;
    this.width = this.height = 0;
    this.x0 = this.y0 = 0; // where the world's corner is
    this.scale = 1; // pixels for 1 m
    /** @type {Record<string, string>} */
    this.ink = {};
    this.hues = HUES.light;
    this.back = document.createElement("canvas");
    this.fit();
  }

  /** Take the size of the page and its colours anew. */
  fit() {
    const { clientWidth, clientHeight } = this.canvas;
    this.density = Math.min(3, window.devicePixelRatio || 1);
    this.width = clientWidth;
    this.height = clientHeight;
    for (const layer of [this.canvas, this.back]) {
      layer.width = Math.max(1, Math.round(clientWidth * this.density));
      layer.height = Math.max(1, Math.round(clientHeight * this.density));
    }
    this.ink = inks("card", "faint", "accent", "floor", "grid", "edge", "shadow");
    this.hues = HUES[document.documentElement.dataset.theme === "dark" ? "dark" : "light"];
    this.place();
  }

  /** Put what is in view where zoom and middle say, as far as the arena goes. */
  place() {
    const scene = this.model.scene;
    if (!scene) return;
    const { left, right, top, bottom } = MARGIN;
    const room = [Math.max(50, this.width - left - right), Math.max(50, this.height - top - bottom)];
    this.scale = this.zoom * Math.min(room[0] / scene.width, room[1] / scene.depth);
    this.middle = [scene.width, scene.depth].map((size, axis) =>
      this.zoom > 1 ? between(this.middle[axis], 0, size) : size / 2,
    );
    this.x0 = left + room[0] / 2 - this.middle[0] * this.scale;
    this.y0 = top + room[1] / 2 + this.middle[1] * this.scale;
    this.drawBack(scene);
  }

  /**
   * Zoom, so that the place under a point of the canvas stays there.
   * @param {number} factor
   * @param {number} [left] pixels; the middle without it
   * @param {number} [top]
   */
  zoomBy(factor, left = this.width / 2, top = this.height / 2) {
    const [x, y] = this.toWorld(left, top);
    this.zoom = between(this.zoom * factor, 1, CLOSEST);
    this.place();
    const [newX, newY] = this.toWorld(left, top);
    this.panBy((newX - x) * this.scale, (y - newY) * this.scale);
  }

  /** @param {number} right pixels @param {number} down */
  panBy(right, down) {
    this.middle = [this.middle[0] - right / this.scale, this.middle[1] + down / this.scale];
    this.place();
  }

  /** Show the whole arena. */
  showAll() {
    this.zoom = 1;
    this.followed = null;
    this.place();
  }

  /** @type {(x: number, y: number) => Point} */
  toPixel = (x, y) => [this.x0 + x * this.scale, this.y0 - y * this.scale];

  /** @param {number} left @param {number} top */
  toWorld(left, top) {
    return [(left - this.x0) / this.scale, (this.y0 - top) / this.scale];
  }

  /**
   * Draw what never moves, once.
   * @param {Scene} scene
   */
  drawBack(scene) {
    const pen = penOf(this.back),
      { width, depth, floor } = scene;
    pen.setTransform(this.density, 0, 0, this.density, 0, 0);
    pen.clearRect(0, 0, this.width, this.height);
    const [left, top] = this.toPixel(0, depth),
      [right, bottom] = this.toPixel(width, 0);
    pen.fillStyle = floor.colour ?? this.ink.floor;
    pen.fillRect(left, top, right - left, bottom - top);
    if (this.floor) {
      pen.imageSmoothingEnabled = this.scale * floor.width > this.floor.width;
      const [pictureLeft, pictureTop] = this.toPixel(0, floor.depth);
      pen.save();
      pen.beginPath();
      pen.rect(left, top, right - left, bottom - top);
      pen.clip();
      pen.drawImage(this.floor, pictureLeft, pictureTop, floor.width * this.scale, floor.depth * this.scale);
      pen.restore();
    } else this.drawGrid(pen, scene, left, top, right, bottom);
    pen.lineJoin = pen.lineCap = "round";
    pen.strokeStyle = this.ink.edge;
    pen.lineWidth = 5;
    pen.strokeRect(left - 2.5, top - 2.5, right - left + 5, bottom - top + 5);
    for (const { x1, y1, x2, y2, colour } of this.model.things.wall) {
      for (const [ink, wide] of /** @type {[string, number][]} */ ([
        [this.ink.edge, 5],
        [colour, 2],
      ])) {
        pen.beginPath();
        pen.moveTo(...this.toPixel(x1, y1));
        pen.lineTo(...this.toPixel(x2, y2));
        pen.strokeStyle = ink;
        pen.lineWidth = wide;
        pen.stroke();
      }
    }
    this.drawScale(pen, scene, left, bottom);
  }

  /**
   * @param {Pen} pen
   * @param {Scene} scene
   * @param {number} left
   * @param {number} top
   * @param {number} right
   * @param {number} bottom
   */
  drawGrid(pen, scene, left, top, right, bottom) {
    const step = GRID.find((each) => each * this.scale >= 22) ?? 500;
    pen.strokeStyle = this.ink.grid;
    pen.lineWidth = 1;
    pen.beginPath();
    for (let k = 1; k * step < scene.width - 1e-9; k++) {
      const [x] = this.toPixel(k * step, 0);
      pen.moveTo(x, top);
      pen.lineTo(x, bottom);
    }
    for (let k = 1; k * step < scene.depth - 1e-9; k++) {
      const [, y] = this.toPixel(0, k * step);
      pen.moveTo(left, y);
      pen.lineTo(right, y);
    }
    pen.globalAlpha = scene.floor.colour ? 0.25 : 1; // a darker floor
    pen.stroke();
    pen.globalAlpha = 1;
  }

  /** @param {Pen} pen @param {Scene} scene @param {number} left @param {number} bottom */
  drawScale(pen, scene, left, bottom) {
    const step = GRID.find((each) => each * this.scale >= LABELS) ?? 500;
    /** @type {(k: number) => string} */
    const say = (k) => `${Number((k * step).toFixed(2))}`;
    pen.fillStyle = this.ink.faint;
    pen.strokeStyle = this.ink.card;
    pen.lineWidth = 4;
    pen.font = "12px system-ui, sans-serif";
    /** @type {(text: string, left: number, top: number) => void} */
    const write = (text, left, top) => {
      if (this.zoom > 1) pen.strokeText(text, left, top); // it stands on the floor
      pen.fillText(text, left, top);
    };
    pen.textAlign = "center";
    pen.textBaseline = "top";
    const across = Math.floor(scene.width / step + 1e-9),
      up = Math.floor(scene.depth / step + 1e-9);
    const low = Math.min(bottom + 8, this.height - 16),
      high = Math.max(left - 8, 28);
    for (let k = 0; k <= across; k++) {
      const [x] = this.toPixel(k * step, 0);
      if (x > 0 && x < this.width) write(say(k) + (k === across ? " m" : ""), Math.min(x, this.width - 20), low);
    }
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (let k = 0; k <= up; k++) {
      const [, y] = this.toPixel(0, k * step);
      if (y > 0 && y < low - 8) write(say(k), high, y);
    }
  }

  /** Draw everything. */
  draw() {
    const pen = penOf(this.canvas),
      { scene, frame } = this.model;
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    if (!scene || !frame) return;
    if (this.followed !== null) {
      const [x, y] = this.model.pose({ kind: "robot", index: this.followed });
      if (Math.hypot(x - this.middle[0], y - this.middle[1]) * this.scale > 0.5) {
        this.middle = [x, y];
        this.place();
      }
    }
    const { box, cylinder, light, sound } = this.model.things;
    pen.drawImage(this.back, 0, 0);
    pen.setTransform(this.density, 0, 0, this.density, 0, 0);
    pen.lineCap = pen.lineJoin = "round";
    light.forEach((each) => this.drawGlow(pen, scene, each));
    this.drawShadows(pen, scene, frame);
    this.model.trails.forEach((trail, k) => this.drawTrail(pen, trail, this.hues[k % this.hues.length]));
    box.forEach((each) => this.drawBox(pen, each));
    cylinder.forEach((each) => this.drawPost(pen, each));
    if (frame.rays) drawRays(pen, frame.rays, this.toPixel);
    for (let k = 0; k < frame.count; k++) this.drawOne(pen, scene, frame, k);
    sound.forEach((each) => this.drawSound(pen, each));
    light.forEach((each) => this.drawLamp(pen, each));
    this.drawMark(pen);
  }

  /** @param {Pen} pen @param {Scene} scene @param {Frame} frame */
  drawShadows(pen, scene, frame) {
    const shift = Math.min(6, 0.01 * this.scale);
    pen.fillStyle = this.ink.shadow;
    pen.save();
    pen.translate(shift, shift);
    for (const box of this.model.things.box) {
      this.outline(pen, box);
      pen.fill();
    }
    for (const post of this.model.things.cylinder) {
      this.circle(pen, post.x, post.y, post.radius * this.scale);
      pen.fill();
    }
    pen.translate(-0.4 * shift, -0.4 * shift);
    for (let k = 0; k < frame.count; k++) {
      this.circle(pen, frame.poses[3 * k], frame.poses[3 * k + 1], scene.radius * this.scale);
      pen.fill();
    }
    pen.restore();
  }

  /** @param {Pen} pen @param {number} x @param {number} y @param {number} radius */
  circle(pen, x, y, radius) {
    pen.beginPath();
    pen.arc(...this.toPixel(x, y), radius, 0, 7);
  }

  /** @param {Pen} pen @param {Box} box @param {number} [share=1] */
  outline(pen, box, share = 1) {
    const cosine = Math.cos(box.angle),
      sine = Math.sin(box.angle);
    pen.beginPath();
    for (const [u, v] of [
      [-1, -1],
      [1, -1],
      [1, 1],
      [-1, 1],
    ]) {
      const along = (share * u * box.width) / 2,
        across = (share * v * box.depth) / 2;
      pen.lineTo(...this.toPixel(box.x + cosine * along - sine * across, box.y + sine * along + cosine * across));
    }
    pen.closePath();
  }

  /** @param {Pen} pen @param {Box} box */
  drawBox(pen, box) {
    this.outline(pen, box);
    pen.fillStyle = box.colour;
    pen.fill();
    pen.strokeStyle = "rgba(30, 34, 42, 0.5)";
    pen.lineWidth = 2;
    pen.stroke();
    if (box.pushable) {
      this.outline(pen, box, 0.62);
      pen.strokeStyle = "rgba(255, 255, 255, 0.75)";
      pen.lineWidth = 1.5;
      pen.stroke();
    }
  }

  /** @param {Pen} pen @param {Cylinder} post */
  drawPost(pen, post) {
    const radius = post.radius * this.scale;
    this.circle(pen, post.x, post.y, radius);
    pen.fillStyle = post.colour;
    pen.fill();
    pen.strokeStyle = "rgba(30, 34, 42, 0.5)";
    pen.lineWidth = 2;
    pen.stroke();
    this.circle(pen, post.x, post.y, 0.62 * radius);
    if (post.pushable) {
      pen.strokeStyle = "rgba(255, 255, 255, 0.75)";
      pen.lineWidth = 1.5;
      pen.stroke();
    } else {
      pen.fillStyle = "rgba(255, 255, 255, 0.22)";
      pen.fill();
    }
  }

  /** @param {Pen} pen @param {Point[]} trail @param {string} hue */
  drawTrail(pen, trail, hue) {
    pen.strokeStyle = hue;
    pen.lineWidth = Math.max(1.5, 0.004 * this.scale);
    pen.lineCap = "butt"; // round ends of pale pieces would show as dots where they overlap
    for (let k = 0; k < PALE; k++) {
      const from = Math.floor(((trail.length - 1) * k) / PALE),
        to = Math.floor(((trail.length - 1) * (k + 1)) / PALE);
      if (to <= from) continue;
      pen.globalAlpha = 0.15 + (0.75 * (k + 1)) / PALE;
      pen.beginPath();
      for (let point = from; point <= to; point++) pen.lineTo(...this.toPixel(...trail[point]));
      pen.stroke();
    }
    pen.globalAlpha = 1;
    pen.lineCap = "round";
  }

  /** @param {Pen} pen @param {Scene} scene @param {Frame} frame @param {number} k */
  drawOne(pen, scene, frame, k) {
    const [x, y, heading] = frame.poses.subarray(3 * k, 3 * k + 3);
    const at = this.toPixel(x, y),
      radius = scene.radius * this.scale,
      bits = frame.bits[k];
    drawRobot(pen, at, heading, radius, bits, frame.ring.subarray(24 * k, 24 * k + 24), scene.leds, this.ink.edge);
    if (bits & CUT) this.drawCut(pen, at[0] + 0.8 * radius, at[1] - 0.8 * radius, Math.max(6, 0.34 * radius));
    if (radius < 7) return;
    pen.font = `600 ${Math.max(11, Math.min(15, 0.45 * radius))}px system-ui, sans-serif`;
    pen.textAlign = "center";
    pen.textBaseline = "top";
    pen.lineWidth = 3;
    pen.strokeStyle = this.ink.floor;
    pen.fillStyle = this.hues[k % this.hues.length];
    const name = scene.robots > 50 || (scene.robots > 8 && radius < 12) ? `${k + 1}` : scene.names[k],
      gap = this.selected?.key === `robot:${k}` ? 8 : 3;
    const below =
      at[1] + radius + gap + 15 < Math.min(this.y0, this.height - 20)
        ? at[1] + radius + gap
        : at[1] - radius - gap - 14;
    pen.strokeText(name, at[0], below);
    pen.fillText(name, at[0], below);
  }

  /** @param {Pen} pen @param {number} x @param {number} y @param {number} size */
  drawCut(pen, x, y, size) {
    pen.beginPath();
    pen.arc(x, y, size, 0, 7);
    pen.fillStyle = "#b02a2a";
    pen.fill();
    pen.beginPath();
    pen.moveTo(x - 0.45 * size, y - 0.45 * size);
    pen.lineTo(x + 0.45 * size, y + 0.45 * size);
    pen.moveTo(x + 0.45 * size, y - 0.45 * size);
    pen.lineTo(x - 0.45 * size, y + 0.45 * size);
    pen.strokeStyle = "#ffffff";
    pen.lineWidth = Math.max(1.5, 0.22 * size);
    pen.stroke();
  }

  /** @param {Pen} pen @param {Scene} scene @param {Light} light */
  drawGlow(pen, scene, light) {
    // Half its intensity, in metres, is where a light has fallen to 1/e.
    const radius = Math.min(0.5 * light.intensity, 3) * this.scale,
      [x, y] = this.toPixel(light.x, light.y);
    if (radius < 1) return;
    const glow = pen.createRadialGradient(x, y, 0, x, y, radius);
    glow.addColorStop(0, "rgba(255, 205, 60, 0.5)");
    glow.addColorStop(0.4, "rgba(255, 205, 60, 0.18)");
    glow.addColorStop(1, "rgba(255, 205, 60, 0)");
    pen.save();
    pen.beginPath();
    pen.rect(this.x0, this.y0 - scene.depth * this.scale, scene.width * this.scale, scene.depth * this.scale);
    pen.clip();
    pen.fillStyle = glow;
    pen.fillRect(x - radius, y - radius, 2 * radius, 2 * radius);
    pen.restore();
  }

  /** @param {Pen} pen @param {Light} light */
  drawLamp(pen, light) {
    const [x, y] = this.toPixel(light.x, light.y),
      size = Math.max(6, 0.012 * this.scale),
      isOn = light.intensity > 0;
    pen.strokeStyle = isOn ? "#b77900" : this.ink.faint;
    pen.lineWidth = 2;
    for (let k = 0; isOn && k < 8; k++) {
      const cosine = Math.cos((k * Math.PI) / 4),
        sine = Math.sin((k * Math.PI) / 4);
      pen.beginPath();
      pen.moveTo(x + 1.4 * size * cosine, y + 1.4 * size * sine);
      pen.lineTo(x + 1.9 * size * cosine, y + 1.9 * size * sine);
      pen.stroke();
    }
    pen.beginPath();
    pen.arc(x, y, size, 0, 7);
    pen.fillStyle = isOn ? "#ffd23c" : this.ink.floor;
    pen.fill();
    pen.stroke();
  }

  /** @param {Pen} pen @param {Sound} sound */
  drawSound(pen, sound) {
    const [x, y] = this.toPixel(sound.x, sound.y),
      size = Math.max(5, 0.01 * this.scale);
    pen.strokeStyle = pen.fillStyle = sound.volume > 0 ? "#7a5cc0" : this.ink.faint;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(x, y, 0.7 * size, 0, 7);
    if (sound.volume > 0) pen.fill();
    else pen.stroke();
    const rings = sound.volume > 0 ? 1 + Math.round(Math.min(2, sound.volume / 1000)) : 0;
    for (let k = 1; k <= rings; k++) {
      pen.globalAlpha = 1 - 0.25 * k;
      pen.beginPath();
      pen.arc(x, y, (0.7 + 0.7 * k) * size, 0, 7);
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }

  /**
   * Mark what is selected.
   * @param {Pen} pen
   */
  drawMark(pen) {
    if (!this.selected) return;
    const [x, y] = this.model.pose(this.selected);
    this.circle(pen, x, y, Math.max(11, this.model.reach(this.selected) * this.scale + 5));
    pen.setLineDash([6, 4]);
    pen.strokeStyle = this.ink.accent;
    pen.lineWidth = 2;
    pen.stroke();
    pen.setLineDash([]);
  }
}
