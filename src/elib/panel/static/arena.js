// The canvas: arena, things, robots. It draws what the model holds, once for each frame.

import { inks } from "./dom.js";
import { CUT, HUES, circle, drawRays, drawRobot, grid, line, paint, stepOf } from "./robotshape.js";

/** @import { Model, Thing } from "./model.js" */
/** @import { Pen, Point } from "./robotshape.js" */
/** @import { Box, Cylinder, Frame, Light, Scene, Sound } from "./frames.js" */

/** @type {(value: number, low: number, high: number) => number} */
const between = (value, low, high) => Math.max(low, Math.min(high, value));

const LABELS = 64; // pixels between two numbers at the edge, at least
const PALE = 8; // steps from an old trail to a new one
const MARGIN = { left: 36, right: 10, top: 10, bottom: 26 }; // pixels around the arena, for the scale
const CLOSEST = 40; // times as large as the whole arena

/** @param {HTMLCanvasElement} canvas */
function penOf(canvas) {
  return /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
}

export class Arena {
  /** @param {HTMLCanvasElement} canvas @param {Model} model @param {number[]} leds the angles of a robot's ring, rad */
  constructor(canvas, model, leds) {
    this.canvas = canvas;
    this.leds = leds;
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
    } else {
      grid(pen, stepOf(this.scale, 22) * this.scale, [left, bottom], [left, top], [right, bottom]);
      pen.globalAlpha = floor.colour ? 0.25 : 1; // a darker floor
      paint(pen, "", this.ink.grid, 1);
      pen.globalAlpha = 1;
    }
    pen.lineJoin = pen.lineCap = "round";
    pen.strokeStyle = this.ink.edge;
    pen.lineWidth = 5;
    pen.strokeRect(left - 2.5, top - 2.5, right - left + 5, bottom - top + 5);
    for (const { x1, y1, x2, y2, colour } of this.model.things.wall) {
      line(pen, this.toPixel(x1, y1), this.toPixel(x2, y2));
      paint(pen, "", this.ink.edge, 5);
      paint(pen, "", colour, 2);
    }
    this.drawScale(pen, scene, left, bottom);
  }

  /** @param {Pen} pen @param {Scene} scene @param {number} left @param {number} bottom */
  drawScale(pen, scene, left, bottom) {
    const step = stepOf(this.scale, LABELS);
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
    for (const each of [...box, ...cylinder]) this.drawObstacle(pen, each);
    if (frame.rays) drawRays(pen, frame.rays, this.toPixel);
    for (let k = 0; k < frame.count; k++) this.drawOne(pen, scene, frame, k);
    for (let k = 0; k < frame.count; k++) this.drawName(pen, scene, frame, k);
    sound.forEach((each) => this.drawSound(pen, each));
    light.forEach((each) => this.drawLamp(pen, each));
    this.drawMark(pen);
  }

  /** @param {Pen} pen @param {Scene} scene @param {Frame} frame */
  drawShadows(pen, scene, frame) {
    const shift = Math.min(6, 0.01 * this.scale),
      { box, cylinder } = this.model.things;
    pen.save();
    pen.translate(shift, shift);
    for (const each of [...box, ...cylinder]) {
      this.outline(pen, each);
      paint(pen, this.ink.shadow);
    }
    pen.translate(-0.4 * shift, -0.4 * shift);
    for (let k = 0; k < frame.count; k++) {
      circle(pen, this.toPixel(frame.poses[3 * k], frame.poses[3 * k + 1]), scene.radius * this.scale);
      paint(pen, this.ink.shadow);
    }
    pen.restore();
  }

  /** @param {Pen} pen @param {Box | Cylinder} thing @param {number} [share=1] */
  outline(pen, thing, share = 1) {
    if ("radius" in thing) return circle(pen, this.toPixel(thing.x, thing.y), share * thing.radius * this.scale);
    const { x, y, angle } = thing,
      [along, across] = [(share * thing.width) / 2, (share * thing.depth) / 2],
      [cosine, sine] = [Math.cos(angle), Math.sin(angle)];
    /** @type {(u: number, v: number) => Point} */
    const corner = (u, v) => this.toPixel(x + cosine * u - sine * v, y + sine * u + cosine * v);
    line(pen, corner(-along, -across), corner(along, -across), corner(along, across), corner(-along, across));
    pen.closePath();
  }

  /** @param {Pen} pen @param {Box | Cylinder} thing */
  drawObstacle(pen, thing) {
    this.outline(pen, thing);
    paint(pen, thing.colour, "rgba(30, 34, 42, 0.5)");
    this.outline(pen, thing, 0.62);
    if (thing.pushable) paint(pen, "", "rgba(255, 255, 255, 0.75)", 1.5);
    else if ("radius" in thing) paint(pen, "rgba(255, 255, 255, 0.22)");
  }

  /** @param {Pen} pen @param {Point[]} trail @param {string} hue */
  drawTrail(pen, trail, hue) {
    pen.lineCap = "butt"; // round ends of pale pieces would show as dots where they overlap
    for (let k = 0; k < PALE; k++) {
      const from = Math.floor(((trail.length - 1) * k) / PALE),
        to = Math.floor(((trail.length - 1) * (k + 1)) / PALE);
      if (to <= from) continue;
      pen.globalAlpha = 0.15 + (0.75 * (k + 1)) / PALE;
      line(pen, ...trail.slice(from, to + 1).map((point) => this.toPixel(...point)));
      paint(pen, "", hue, Math.max(1.5, 0.004 * this.scale));
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
    const ring = frame.ring.subarray(24 * k, 24 * k + 24);
    drawRobot(pen, [...at, heading], radius, this.ink.edge, this.leds, bits, ring);
    if (bits & CUT) this.drawCut(pen, at[0] + 0.8 * radius, at[1] - 0.8 * radius, Math.max(6, 0.34 * radius));
  }

  /** @param {Pen} pen @param {Scene} scene @param {Frame} frame @param {number} k */
  drawName(pen, scene, frame, k) {
    const at = this.toPixel(frame.poses[3 * k], frame.poses[3 * k + 1]),
      radius = scene.radius * this.scale;
    if (radius < 7) return;
    pen.font = `600 ${Math.max(11, Math.min(15, 0.45 * radius))}px system-ui, sans-serif`;
    pen.textAlign = "center";
    pen.textBaseline = "top";
    pen.lineWidth = 3;
    pen.strokeStyle = this.ink.floor;
    pen.fillStyle = this.hues[k % this.hues.length];
    const name = scene.robots > 8 ? `${k + 1}` : scene.names[k],
      gap = this.selected?.key === `robot:${k}` ? 8 : 3;
    const below =
      at[1] + radius + gap + 15 < Math.min(this.y0, this.height - 20)
        ? at[1] + radius + gap
        : at[1] - radius - gap - 14;
    // On the floor, or at the edge of the canvas where that is nearer.
    const half = pen.measureText(name).width / 2 + 3,
      low = Math.max(0, this.x0),
      high = Math.min(this.width, this.x0 + scene.width * this.scale);
    const x = between(at[0], low + half, Math.max(low, high - half));
    pen.strokeText(name, x, below);
    pen.fillText(name, x, below);
  }

  /** @param {Pen} pen @param {number} x @param {number} y @param {number} size */
  drawCut(pen, x, y, size) {
    const arm = 0.45 * size;
    circle(pen, [x, y], size);
    paint(pen, "#b02a2a");
    for (const side of [-arm, arm]) {
      line(pen, [x - arm, y - side], [x + arm, y + side]);
      paint(pen, "", "#ffffff", Math.max(1.5, 0.22 * size));
    }
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
    const edge = isOn ? "#b77900" : this.ink.faint;
    for (let k = 0; isOn && k < 8; k++) {
      const [right, up] = [size * Math.cos((k * Math.PI) / 4), size * Math.sin((k * Math.PI) / 4)];
      line(pen, [x + 1.4 * right, y + 1.4 * up], [x + 1.9 * right, y + 1.9 * up]);
      paint(pen, "", edge);
    }
    circle(pen, [x, y], size);
    paint(pen, isOn ? "#ffd23c" : this.ink.floor, edge);
  }

  /** @param {Pen} pen @param {Sound} sound */
  drawSound(pen, sound) {
    const at = this.toPixel(sound.x, sound.y),
      size = Math.max(5, 0.01 * this.scale),
      isOn = sound.volume > 0,
      ink = isOn ? "#7a5cc0" : this.ink.faint;
    circle(pen, at, 0.7 * size);
    paint(pen, isOn ? ink : "", isOn ? "" : ink);
    const rings = isOn ? 1 + Math.round(Math.min(2, sound.volume / 1000)) : 0;
    for (let k = 1; k <= rings; k++) {
      pen.globalAlpha = 1 - 0.25 * k;
      circle(pen, at, (0.7 + 0.7 * k) * size);
      paint(pen, "", ink);
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
    circle(pen, this.toPixel(x, y), Math.max(11, this.model.reach(this.selected) * this.scale + 5));
    pen.setLineDash([6, 4]);
    paint(pen, "", this.ink.accent);
    pen.setLineDash([]);
  }
}
