// The world from above on a flat canvas, where the browser has no WebGL. It shows what View shows, plainly.
import { stepOf } from "../look/canvas";
import { hello } from "../store";
import { FRAME } from "../messages";
import type { Pose, World } from "./scene";
import { Stage } from "./Stage";

type Point = [x: number, y: number];
const PEN = 0.006; // m: how wide a pen's line is
const EDGE = "rgba(30, 34, 42, 0.5)"; // around things

export class Flat extends Stage {
  override readonly isFlat = true;
  private floor: HTMLImageElement | null = null;

  constructor(canvas: HTMLCanvasElement, world: World) {
    super(canvas, world);
    this.ends.push(world.scene.subscribe((scene) => this.lay(scene?.floor_png)));
  }

  private async lay(source: string | null | undefined) {
    const picture = new Image();
    this.floor = null;
    if (!source) return;
    picture.src = source;
    await picture.decode().catch(() => null);
    this.floor = picture.naturalWidth ? picture : null;
    this.invalidate();
  }

  /** Draw a line through points, or what it goes around if that is to be filled. */
  private shape(points: Point[], fill: string, edge = "", width = 2) {
    this.pen.beginPath();
    for (const [x, y] of points) {
      const [left, top] = this.toPixel(x, y);
      this.pen.lineTo(left, top);
    }
    if (fill) this.pen.closePath();
    this.finish(fill, edge, width);
  }

  private disc(x: number, y: number, radius: number, fill: string, edge = "") {
    const [left, top] = this.toPixel(x, y);
    this.pen.beginPath();
    this.pen.arc(left, top, Math.max(0.5, radius * this.scale), 0, 7);
    this.finish(fill, edge, 2);
  }

  private finish(fill: string, edge: string, width: number) {
    Object.assign(this.pen, { fillStyle: fill, strokeStyle: edge, lineWidth: width });
    if (fill) this.pen.fill();
    if (edge) this.pen.stroke();
  }

  protected paint(now: number) {
    const { pen, world } = this,
      { width, depth, floor } = world.scene.value!,
      { wall, box, cylinder, light, sound } = world.things.value,
      [boxes, posts, poses] = (["box", "cylinder", "robot"] as const).map((kind) => world.shown(kind, now)),
      rays = world.frame.value?.rays ?? [];
    pen.setTransform(this.density, 0, 0, this.density, 0, 0);
    pen.fillStyle = this.ink("room");
    pen.fillRect(0, 0, this.width, this.height);
    const corners: Point[] = [0, width].flatMap((x) => [0, depth].map((y): Point => [x, x ? depth - y : y]));
    this.shape(corners, floor.colour ?? this.ink("floor"), this.ink("wall"), 5);
    pen.save();
    pen.clip();
    const [left, top] = this.toPixel(0, floor.depth);
    if (this.floor) pen.drawImage(this.floor, left, top, floor.width * this.scale, floor.depth * this.scale);
    else this.grid(width, depth, floor.colour ? 0.3 : 1);
    for (const { x, y, intensity } of light) this.disc(x, y, Math.min(0.5 * intensity, 3), "rgba(255, 205, 60, 0.25)");
    for (const { points, colour, on, picture } of world.zones.value) {
      pen.globalAlpha = picture ? 0 : on ? 0.4 : 0.15;
      this.shape(points, colour);
      pen.globalAlpha = 1;
      this.shape([...points, points[0]], "", colour, 1.5);
    }
    world.lines.forEach((line, k) => this.shape(line, "", world.scene.value!.pens[k] ?? "", PEN * this.scale));
    pen.restore();
    world.trails.forEach((trail, k) => this.hasTrails.value && this.shape(trail, "", this.hue(k)));
    const block = (x: number, y: number, angle: number, width: number, depth: number, colour: string, edge = EDGE) => {
      const [c, s] = [Math.cos(angle) / 2, Math.sin(angle) / 2],
        corner = (u: number, v: number): Point => [
          x + u * c * width - v * s * depth,
          y + u * s * width + v * c * depth,
        ];
      this.shape([corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)], colour, edge);
    };
    for (const { points, colour } of world.scene.value!.blocks) this.shape(points, colour);
    for (const { x, y, angle, width, depth, colour } of wall)
      block(x, y, angle, width, depth, colour, this.ink("wall"));
    box.forEach(({ width, depth, colour }, k) =>
      block(boxes[3 * k], boxes[3 * k + 1], boxes[3 * k + 2], width, depth, colour),
    );
    cylinder.forEach(({ radius, colour }, k) => this.disc(posts[3 * k], posts[3 * k + 1], radius, colour, EDGE));
    for (let k = 0; k < rays.length; k += 5) {
      const lit = Math.min(1, 4 * rays[k + 4]),
        ends: Point[] = [0, 2].map((end) => [rays[k + end], rays[k + end + 1]]);
      pen.globalAlpha = lit < 0.02 ? 0.35 : 1;
      this.shape(ends, "", this.ink(lit > 0.3 ? "ray" : "ray-far"), 2 + 2 * lit);
    }
    pen.globalAlpha = 1;
    for (let k = 0; k < (world.frame.value?.count ?? 0); k++)
      this.robot(k, ...(poses.subarray(3 * k) as never as Pose));
    for (const { x, y, volume } of sound) this.disc(x, y, 0.012, volume ? this.ink("noise") : "", this.ink("noise"));
    for (const { x, y, intensity } of light)
      this.disc(x, y, 0.013, intensity ? this.ink("motion") : this.ink("room"), "#b77900");
  }

  private grid(width: number, depth: number, alpha: number) {
    const step = stepOf(this.scale, 22);
    this.pen.globalAlpha = alpha;
    for (let x = step; x < width; x += step) this.line([x, 0], [x, depth]);
    for (let y = step; y < depth; y += step) this.line([0, y], [width, y]);
    this.pen.globalAlpha = 1;
  }

  private line(...ends: Point[]) {
    this.shape(ends, "", this.ink("grid"), 1);
  }

  private robot(k: number, x: number, y: number, heading: number) {
    const { radius } = this.world.scene.value!,
      { bits, ring } = this.world.frame.value!,
      [c, s] = [radius * Math.cos(heading), radius * Math.sin(heading)],
      place = (ahead: number, left: number): Point => [x + c * ahead - s * left, y + s * ahead + c * left],
      isLit = bits[k] & FRAME.body;
    this.disc(x, y, radius, bits[k] & FRAME.touching ? "#e2402e" : this.ink("wall"));
    this.disc(x, y, 0.94 * radius, this.ink("shell"));
    for (const side of [-0.75, 0.75])
      this.shape([place(-0.34, side), place(0.34, side)], "", this.ink("tyre"), 0.18 * radius * this.scale);
    this.disc(x, y, 0.66 * radius, isLit ? this.ink("lit-body") : "#b2d6a8");
    this.disc(x, y, 0.5 * radius, this.ink("board"));
    this.shape([place(0.46, 0), place(-0.22, 0.28), place(-0.1, 0), place(-0.22, -0.28)], "#fafaf6");
    hello.value!.ring.leds.forEach((turn, led) => {
      const colour = ring.subarray(24 * k + 3 * led, 24 * k + 3 * led + 3).join(),
        spot = place(0.86 * Math.cos(turn), 0.86 * Math.sin(turn));
      if (colour === "0,0,0") return this.disc(...spot, 0.055 * radius, "#8cac84");
      this.disc(...spot, 0.3 * radius, `rgba(${colour}, 0.28)`);
      this.disc(...spot, 0.15 * radius, `rgb(${colour})`);
    });
    if (bits[k] & FRAME.front) this.disc(...place(0.93, -0.34), 0.11 * radius, this.ink("lit-front"));
  }
}
