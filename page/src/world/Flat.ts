// The world from above on a flat canvas, where the browser has no WebGL. It shows what View shows, plainly.
import { BODY, FRONT, TOUCHING, type World } from "./scene";
import { Stage, stepOf } from "./Stage";

type Point = [x: number, y: number];

export class Flat extends Stage {
  override readonly isFlat = true;
  private floor: HTMLImageElement | null = null;

  constructor(canvas: HTMLCanvasElement, world: World, leds: number[]) {
    super(canvas, world, leds);
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

  private shape(points: Point[], fill: string, edge = "", width = 2) {
    const { pen } = this;
    pen.beginPath();
    for (const [x, y] of points) pen.lineTo(...(this.toPixel(x, y).slice(0, 2) as Point));
    if (fill) pen.closePath();
    this.ink2(fill, edge, width);
  }

  private disc(x: number, y: number, radius: number, fill: string, edge = "", width = 2) {
    const [left, top] = this.toPixel(x, y);
    this.pen.beginPath();
    this.pen.arc(left, top, Math.max(0.5, radius * this.scale), 0, 7);
    this.ink2(fill, edge, width);
  }

  private ink2(fill: string, edge: string, width: number) {
    Object.assign(this.pen, { fillStyle: fill, strokeStyle: edge, lineWidth: width });
    if (fill) this.pen.fill();
    if (edge) this.pen.stroke();
  }

  protected paint(now: number) {
    const { pen, world } = this,
      { width, depth, floor } = world.scene.value!,
      { wall, box, cylinder, light, sound } = world.things.value,
      corners: Point[] = [
        [0, 0],
        [width, 0],
        [width, depth],
        [0, depth],
      ];
    pen.setTransform(this.density, 0, 0, this.density, 0, 0);
    pen.fillStyle = this.ink("room");
    pen.fillRect(0, 0, this.width, this.height);
    this.shape(corners, floor.colour ?? this.ink("floor"), this.ink("wall"), 5);
    pen.save();
    pen.clip();
    const [left, top] = this.toPixel(0, floor.depth);
    if (this.floor) pen.drawImage(this.floor, left, top, floor.width * this.scale, floor.depth * this.scale);
    else this.grid(width, depth, stepOf(this.scale, 22), floor.colour ? 0.3 : 1);
    for (const { x, y, intensity } of light) this.disc(x, y, Math.min(0.5 * intensity, 3), "rgba(255, 205, 60, 0.25)");
    pen.restore();
    world.trails.forEach((trail, k) => this.hasTrails.value && this.shape(trail, "", this.hue(k)));
    for (const { x1, y1, x2, y2, colour } of wall) {
      this.shape(
        [
          [x1, y1],
          [x2, y2],
        ],
        "",
        this.ink("wall"),
        5,
      );
      this.shape(
        [
          [x1, y1],
          [x2, y2],
        ],
        "",
        colour,
        2,
      );
    }
    const boxes = world.shown("box", now),
      posts = world.shown("cylinder", now);
    box.forEach((each, k) => {
      const [x, y, angle] = boxes.subarray(3 * k),
        [c, s] = [Math.cos(angle) / 2, Math.sin(angle) / 2];
      const corner = (u: number, v: number): Point => [
        x + u * c * each.width - v * s * each.depth,
        y + u * s * each.width + v * c * each.depth,
      ];
      this.shape([corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)], each.colour, "rgba(30, 34, 42, 0.5)");
    });
    cylinder.forEach(({ radius, colour }, k) =>
      this.disc(posts[3 * k], posts[3 * k + 1], radius, colour, "rgba(30, 34, 42, 0.5)"),
    );
    const rays = world.frame.value?.rays ?? [];
    for (let k = 0; k < rays.length; k += 5) {
      const lit = Math.min(1, 4 * rays[k + 4]);
      pen.globalAlpha = lit < 0.02 ? 0.35 : 1;
      this.shape(
        [
          [rays[k], rays[k + 1]],
          [rays[k + 2], rays[k + 3]],
        ],
        "",
        this.ink(lit > 0.3 ? "ray" : "ray-far"),
        2 + 2 * lit,
      );
    }
    pen.globalAlpha = 1;
    const poses = world.shown("robot", now);
    for (let k = 0; k < (world.frame.value?.count ?? 0); k++)
      this.robot(k, ...(poses.subarray(3 * k) as unknown as [number, number, number]));
    for (const { x, y, volume } of sound) this.disc(x, y, 0.012, volume ? this.ink("noise") : "", this.ink("noise"));
    for (const { x, y, intensity } of light)
      this.disc(x, y, 0.013, intensity ? "#ffd23c" : this.ink("room"), "#b77900");
  }

  private grid(width: number, depth: number, step: number, alpha: number) {
    this.pen.globalAlpha = alpha;
    for (let x = step; x < width; x += step)
      this.shape(
        [
          [x, 0],
          [x, depth],
        ],
        "",
        this.ink("grid"),
        1,
      );
    for (let y = step; y < depth; y += step)
      this.shape(
        [
          [0, y],
          [width, y],
        ],
        "",
        this.ink("grid"),
        1,
      );
    this.pen.globalAlpha = 1;
  }

  private robot(k: number, x: number, y: number, heading: number) {
    const { radius } = this.world.scene.value!,
      { bits, ring } = this.world.frame.value!,
      [c, s] = [radius * Math.cos(heading), radius * Math.sin(heading)],
      place = (ahead: number, left: number): Point => [x + c * ahead - s * left, y + s * ahead + c * left],
      isLit = bits[k] & BODY;
    this.disc(x, y, radius, bits[k] & TOUCHING ? "#e2402e" : this.ink("wall"));
    this.disc(x, y, 0.94 * radius, "#424952");
    for (const side of [-1, 1])
      this.shape(
        [place(-0.34, 0.66 * side), place(0.34, 0.66 * side), place(0.34, 0.84 * side), place(-0.34, 0.84 * side)],
        "#1c1e22",
      );
    this.disc(x, y, 0.66 * radius, isLit ? "#78ec6e" : "#b2d6a8");
    this.disc(x, y, 0.5 * radius, isLit ? "#479256" : "#2c6242");
    this.shape([place(0.46, 0), place(-0.22, 0.28), place(-0.1, 0), place(-0.22, -0.28)], "#fafaf6");
    this.leds.forEach((turn, led) => {
      const colour = ring.subarray(24 * k + 3 * led, 24 * k + 3 * led + 3).join(),
        spot = place(0.86 * Math.cos(turn), 0.86 * Math.sin(turn));
      if (colour === "0,0,0") return this.disc(...spot, 0.055 * radius, "#8cac84");
      this.disc(...spot, 0.3 * radius, `rgba(${colour}, 0.28)`);
      this.disc(...spot, 0.15 * radius, `rgb(${colour})`);
    });
    if (bits[k] & FRONT) this.disc(...place(0.93, -0.34), 0.11 * radius, "#ff8c28");
  }
}
