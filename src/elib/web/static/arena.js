// The canvas: arena, things, robots. It draws what the model holds, once for each frame.

import { CUT, HUES, drawRays, drawRobot } from "./robotshape.js";

/** @import { Model, Place, Thing } from "./model.js" */
/** @import { Pen, Point } from "./robotshape.js" */
/** @import { Box, Cylinder, Frame, Light, Scene, Sound } from "./frames.js" */

const GRID = [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200]; // m
const LABELS = 64; // pixels between two numbers at the edge, at least
const PALE = 8; // steps from an old trail to a new one

/** @param {HTMLCanvasElement} canvas */
function penOf(canvas) {
  return /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
}

export class Arena {
  /** @param {HTMLCanvasElement} canvas @param {Model} model */
  constructor(canvas, model) {
    this.canvas = canvas;
    this.model = model;
    this.shows = { trails: true, rays: true, names: true };
    /** @type {Thing | null} */
    this.selected = null;
    /** @type {{ thing: Place, x: number, y: number } | null} */
    this.ghost = null; // where a thing is wanted that has no room there
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
    const style = getComputedStyle(document.documentElement);
    this.ink = Object.fromEntries(
      ["page", "ink", "faint", "accent", "bad", "floor", "grid", "edge", "shadow"].map((name) => [
        name,
        style.getPropertyValue(`--${name}`).trim(),
      ]),
    );
    this.hues = HUES[document.documentElement.dataset.theme === "dark" ? "dark" : "light"];
    const scene = this.model.scene;
    if (!scene) return;
    const left = 44,
      right = 28,
      top = 16,
      bottom = 34;
    const room = [Math.max(50, this.width - left - right), Math.max(50, this.height - top - bottom)];
    this.scale = Math.min(room[0] / scene.width, room[1] / scene.depth);
    this.x0 = left + (room[0] - scene.width * this.scale) / 2;
    this.y0 = top + (room[1] - scene.depth * this.scale) / 2 + scene.depth * this.scale;
    this.drawBack(scene);
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
      { width, depth, walls, floor } = scene;
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
    this.drawScale(pen, scene, left, bottom);
    pen.lineJoin = pen.lineCap = "round";
    pen.strokeStyle = this.ink.edge;
    pen.lineWidth = 5;
    pen.strokeRect(left - 2.5, top - 2.5, right - left + 5, bottom - top + 5);
    for (const [x1, y1, x2, y2, colour] of walls) {
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
    pen.stroke();
  }

  /** @param {Pen} pen @param {Scene} scene @param {number} left @param {number} bottom */
  drawScale(pen, scene, left, bottom) {
    const step = GRID.find((each) => each * this.scale >= LABELS) ?? 500;
    /** @type {(k: number) => string} */
    const say = (k) => `${Number((k * step).toFixed(2))}`;
    pen.fillStyle = this.ink.faint;
    pen.font = "12px system-ui, sans-serif";
    pen.textAlign = "center";
    pen.textBaseline = "top";
    const { width, depth } = scene,
      across = Math.floor(width / step + 1e-9),
      up = Math.floor(depth / step + 1e-9);
    for (let k = 0; k <= across; k++)
      pen.fillText(say(k) + (k === across ? " m" : ""), this.toPixel(k * step, 0)[0], bottom + 10);
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (let k = 0; k <= up; k++)
      pen.fillText(say(k) + (k === up ? " m" : ""), left - 10, this.toPixel(0, k * step)[1]);
  }

  /** Draw everything. */
  draw() {
    const pen = penOf(this.canvas),
      { scene, frame } = this.model;
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    if (!scene || !frame) return;
    pen.drawImage(this.back, 0, 0);
    pen.setTransform(this.density, 0, 0, this.density, 0, 0);
    pen.lineCap = pen.lineJoin = "round";
    scene.lights.forEach((light) => this.drawGlow(pen, scene, light));
    this.drawShadows(pen, scene, frame);
    if (this.shows.trails)
      this.model.trails.forEach((trail, k) => this.drawTrail(pen, trail, this.hues[k % this.hues.length]));
    scene.boxes.forEach((box) => this.drawBox(pen, box));
    scene.cylinders.forEach((post) => this.drawPost(pen, post));
    if (this.shows.rays && frame.rays)
      for (let k = 0; k < frame.count; k++) drawRays(pen, frame.rays, 40 * k, this.toPixel);
    for (let k = 0; k < frame.count; k++) this.drawOne(pen, scene, frame, k);
    scene.sounds.forEach((sound) => this.drawSound(pen, sound));
    scene.lights.forEach((light) => this.drawLamp(pen, light));
    this.drawMarks(pen);
  }

  /** @param {Pen} pen @param {Scene} scene @param {Frame} frame */
  drawShadows(pen, scene, frame) {
    const shift = Math.min(6, 0.01 * this.scale);
    pen.fillStyle = this.ink.shadow;
    pen.save();
    pen.translate(shift, shift);
    for (const box of scene.boxes) {
      this.outline(pen, box);
      pen.fill();
    }
    for (const post of scene.cylinders) {
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
    if (!this.shows.names || radius < 7) return;
    pen.font = `600 ${Math.max(11, Math.min(15, 0.45 * radius))}px system-ui, sans-serif`;
    pen.textAlign = "center";
    pen.textBaseline = "top";
    pen.lineWidth = 3;
    pen.strokeStyle = this.ink.floor;
    pen.fillStyle = this.hues[k % this.hues.length];
    const name = scene.robots > 50 || (scene.robots > 8 && radius < 12) ? `${k + 1}` : `epuck-${k + 1}`,
      gap = this.selected?.key === `robot:${k}` ? 8 : 3;
    const below = at[1] + radius + gap + 15 < this.y0 ? at[1] + radius + gap : at[1] - radius - gap - 14;
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
   * Mark what is selected, and where something has no room.
   * @param {Pen} pen
   */
  drawMarks(pen) {
    if (this.selected) {
      const [x, y] = this.model.pose(this.selected),
        reach = Math.max(11, this.model.reach(this.selected) * this.scale + 5);
      this.circle(pen, x, y, reach);
      pen.setLineDash([6, 4]);
      pen.strokeStyle = this.ink.accent;
      pen.lineWidth = 2;
      pen.stroke();
      pen.setLineDash([]);
    }
    if (this.ghost) {
      this.circle(pen, this.ghost.x, this.ghost.y, Math.max(9, this.model.reach(this.ghost.thing) * this.scale));
      pen.fillStyle = "rgba(200, 40, 40, 0.25)";
      pen.fill();
      pen.strokeStyle = this.ink.bad;
      pen.lineWidth = 2;
      pen.stroke();
    }
  }
}
