// A canvas that shows a world: where one looks from, when it is drawn, and what is written over the picture. How the
// picture itself is made is left to View (three dimensions) and Flat (two).
import { effect, signal } from "@preact/signals";
import { PerspectiveCamera, Vector3 } from "three";
import { inks, stepOf } from "../look/canvas";
import { isDark } from "../look/theme";
import { FRAME } from "../messages";
import { hello } from "../store";
import type { Mode, Place, Pose, World } from "./scene";

const MARGIN = { left: 36, right: 10, top: 10, bottom: 26 }; // pixels around a map, for its scale
const CLOSEST = 40; // times as large as the whole arena
export const CLOSE = 3; // times: the zoom for following a robot
const LEAN = (52 * Math.PI) / 180; // from straight above, at first and as far as it goes
const STEEPEST = (84 * Math.PI) / 180;
const NARROW = (1 * Math.PI) / 180; // fields of view: from above nearly without perspective
const WIDE = (32 * Math.PI) / 180;
const EASE = 0.09; // s for two thirds of the way from one place to another
const BUDGET = 12; // ms in which canvases are drawn before the page gets its turn
const SMALL = 320; // pixels: a canvas without scale, handle and long names
const between = (value: number, low: number, high: number) => Math.max(low, Math.min(high, value));
const isStill = matchMedia("(prefers-reduced-motion: reduce)");

// All canvases of the page share one loop: what does not fit into a frame comes first in the next.
const due = new Set<Stage>();
let isWaiting = false;

function wait() {
  if (!isWaiting && due.size) requestAnimationFrame(drawDue);
  isWaiting ||= due.size > 0;
}

function drawDue(time: number) {
  isWaiting = false;
  for (const stage of [...due]) {
    if (performance.now() - time > BUDGET && stage.drawn) break;
    due.delete(stage);
    stage.draw();
  }
  wait();
}

export abstract class Stage {
  readonly isFlat: boolean = false; // it shows the map alone
  readonly mode = signal<Mode>("above");
  readonly followed = signal<number | null>(null); // the robot that stays in the middle
  readonly hasTrails = signal(true);
  readonly pen: CanvasRenderingContext2D;
  width = 0;
  height = 0; // pixels of the page
  density = 1;
  zoom = 1; // 1 shows the whole arena
  middle: [x: number, y: number] = [0, 0]; // of what is in view, m
  turn = 0.4; // rad: from where one looks, in three dimensions
  lean = LEAN;
  scale = 1; // pixels for 1 m in the middle
  readonly camera = new PerspectiveCamera();
  protected focal = 1; // its focal length, pixels
  private centre = [0, 0]; // the pixel that one looks at
  private point = new Vector3(); // for what is just being calculated
  drawn = 0; // how often
  private slant = 0; // 0 straight from above, 1 in three dimensions
  private last = 0; // when it was drawn, s
  private goesOn = false; // the next picture follows at once
  private isSeen = true;
  private inks = new Map<string, string>();
  private texts = new Map<string, HTMLCanvasElement>();
  private field: number[]; // of a robot's camera: how wide and how high what it sees is at 1 m
  protected ends: (() => void)[] = [];

  constructor(
    readonly canvas: HTMLCanvasElement,
    readonly world: World,
  ) {
    this.pen = canvas.getContext("2d")!;
    this.field = [640, 480].map((pixels) => pixels / hello.value!.body.focal);
    const resized = new ResizeObserver(() => this.fit()),
      seen = new IntersectionObserver(([entry]) => ((this.isSeen = entry.isIntersecting), this.invalidate()));
    resized.observe(canvas);
    seen.observe(canvas);
    this.ends = [
      () => [resized, seen].forEach((each) => each.disconnect()),
      effect(() => {
        void isDark();
        this.redress();
      }),
      effect(() => {
        if (world.scene.value) this.showAll();
      }),
      effect(() => {
        void [world.looks.value, world.things.value, world.zones.value, world.selected.value, world.ambient.value];
        void [this.mode.value, this.followed.value, this.hasTrails.value];
        this.invalidate();
      }),
    ];
  }

  close() {
    due.delete(this);
    this.isSeen = false;
    this.ends.forEach((end) => end());
  }

  /** Have it drawn with the next frame of the screen. */
  invalidate() {
    if (!this.isSeen) return;
    due.add(this);
    wait();
  }

  private fit() {
    const { clientWidth, clientHeight } = this.canvas;
    if (!clientWidth || !clientHeight) return;
    this.density = Math.min(2, window.devicePixelRatio || 1);
    [this.width, this.height] = [clientWidth, clientHeight];
    this.canvas.width = Math.round(clientWidth * this.density);
    this.canvas.height = Math.round(clientHeight * this.density);
    this.draw(); // at once, for a canvas of another size is empty
  }

  /** Take the colours of the page anew, which has another scheme. */
  protected redress() {
    this.inks.clear();
    this.texts.clear();
    this.invalidate();
  }

  /** A colour of the page, by its name in tokens.css. */
  ink(name: string) {
    const found = this.inks.get(name) ?? inks(name)[name];
    this.inks.set(name, found);
    return found;
  }

  hue = (robot: number) => this.ink(`curve-${robot % 8}`);

  get isSmall() {
    return this.width < SMALL;
  }

  // -- the camera --

  /** The robot through whose camera one looks, and that is followed first. */
  get chosen() {
    const selected = this.world.selected.value;
    return selected?.kind === "robot" ? selected.index : (this.world.own ?? 0);
  }

  showAll() {
    this.followed.value = null;
    this.zoom = 1;
    this.invalidate();
  }

  follow(robot: number | null) {
    this.followed.value = robot;
    if (robot !== null) this.zoom = Math.max(CLOSE, this.zoom);
    this.invalidate();
  }

  /** Zoom, so that the place under a point of the canvas stays there. */
  zoomBy(factor: number, left = this.centre[0], top = this.centre[1]) {
    const [x, y] = this.toFloor(left, top);
    this.zoom = between(this.zoom * factor, 1, CLOSEST);
    this.place(this.last);
    const [newX, newY] = this.toFloor(left, top);
    this.shift(x - newX, y - newY);
  }

  /** Move what is in view by so many pixels, as if the floor was pulled. */
  panBy(right: number, down: number) {
    const [left, top] = this.centre,
      [x, y] = this.toFloor(left, top),
      [newX, newY] = this.toFloor(left + right, top + down);
    this.shift(x - newX, y - newY);
  }

  /** Go around what is in the middle. */
  orbitBy(right: number, down: number) {
    this.turn -= right * 0.008;
    this.lean = between(this.lean - down * 0.008, 0, STEEPEST);
    this.invalidate();
  }

  private shift(x: number, y: number) {
    this.middle = [this.middle[0] + x, this.middle[1] + y];
    this.place(this.last);
    this.invalidate();
  }

  /** Put the camera where mode, zoom and middle say; return whether it is still on its way. */
  private place(now: number) {
    const { scene, frame } = this.world,
      mode = this.mode.value;
    if (!scene.value) return false;
    const { width, depth } = scene.value,
      poses = this.world.shown("robot", now),
      follows = this.followed.value !== null && frame.value;
    if (mode === "eye" && frame.value?.count) return this.look(...(poses.subarray(3 * this.chosen) as unknown as Pose));
    const step = isStill.matches ? 1 : 1 - Math.exp(-Math.min(0.2, now - this.last) / EASE),
      wanted = mode === "above" ? 0 : 1;
    this.slant += step * (wanted - this.slant);
    if (Math.abs(wanted - this.slant) < 0.003) this.slant = wanted;
    this.middle = follows
      ? [poses[3 * this.followed.value!], poses[3 * this.followed.value! + 1]]
      : this.zoom > 1
        ? [between(this.middle[0], 0, width), between(this.middle[1], 0, depth)]
        : [width / 2, depth / 2];
    const margin = this.isSmall ? { left: 4, right: 4, top: 4, bottom: 4 } : MARGIN,
      room = [this.width - margin.left - margin.right, this.height - margin.top - margin.bottom],
      [left, top] = [margin.left + room[0] / 2, margin.top + room[1] / 2],
      lean = this.slant * this.lean,
      turn = this.slant * this.turn;
    this.focal = this.height / 2 / Math.tan((NARROW + this.slant * (WIDE - NARROW)) / 2);
    // As large as the whole arena fits in, seen from here: tried, and made better by what sticks out.
    let fitting = Math.min(room[0] / width, room[1] / depth),
      drop = 0; // pixels by which the arena then hangs below the middle
    for (let turns = this.slant ? 4 : 0; turns > 0; turns--) {
      this.aim(width / 2, depth / 2, 0, lean, turn, this.focal / fitting, left, top);
      const corners = [0, width].flatMap((x) => [0, depth].flatMap((y) => [0, 0.1].map((z) => this.toPixel(x, y, z)))),
        tops = corners.map((each) => each[1]),
        reach = Math.max(...corners.map((each) => Math.abs(each[0] - left))),
        [high, low] = [Math.min(...tops), Math.max(...tops)];
      fitting *= Math.min(room[0] / 2 / reach, room[1] / (low - high));
      drop = (high + low) / 2 - top;
    }
    this.scale = this.zoom * fitting;
    const [x, y] = this.middle;
    this.aim(x, y, 0, lean, turn, this.focal / this.scale, left, top - (follows ? 0 : drop / this.zoom));
    return this.slant !== wanted;
  }

  /** Look through the camera of a robot: its whole picture fits on the canvas, and around it there is more to see. */
  private look(x: number, y: number, heading: number) {
    const [ahead, above] = hello.value!.body.eye,
      [eyeX, eyeY] = [x + ahead * Math.cos(heading), y + ahead * Math.sin(heading)],
      quarter = Math.PI / 2;
    this.focal = Math.min((this.width - 16) / this.field[0], (this.height - 16) / this.field[1]);
    this.aim(eyeX, eyeY, above, quarter, heading - quarter, 0, this.width / 2, this.height / 2);
    this.scale = this.focal / 0.3;
    return false;
  }

  /** Put the camera so far from a place, leaning from straight above; the place is then seen at a pixel. */
  private aim(x: number, y: number, z: number, lean: number, turn: number, far: number, left: number, top: number) {
    const { camera, width, height } = this,
      size = Math.hypot(this.world.scene.value!.width, this.world.scene.value!.depth);
    this.centre = [left, top];
    camera.rotation.set(lean, 0, turn, "ZXY");
    camera.position.set(x, y, z);
    camera.translateZ(far);
    camera.near = Math.max(0.01, far - 2 * size);
    camera.far = far + 2 * size;
    camera.fov = ((2 * Math.atan(height / 2 / this.focal)) / Math.PI) * 180;
    camera.setViewOffset(width, height, width / 2 - left, height / 2 - top, width, height);
    camera.updateMatrixWorld();
  }

  /** Where on the canvas a place is, pixels, and how many of them there 1 m has; none behind the camera. */
  toPixel(x: number, y: number, z = 0): [left: number, top: number, scale: number] {
    const seen = this.point.set(x, y, z).applyMatrix4(this.camera.matrixWorldInverse),
      far = -seen.z;
    if (far < 1e-3) return [NaN, NaN, 0];
    seen.applyMatrix4(this.camera.projectionMatrix);
    return [((1 + seen.x) / 2) * this.width, ((1 - seen.y) / 2) * this.height, this.focal / far];
  }

  /** The place under a point of the canvas, at a height above the floor; far away where one looks over it. */
  toFloor(left: number, top: number, z = 0): [x: number, y: number] {
    const { position } = this.camera,
      seen = this.point.set((2 * left) / this.width - 1, 1 - (2 * top) / this.height, 0.5).unproject(this.camera),
      ray = seen.sub(position).normalize(),
      along = ray.z < -1e-6 ? (z - position.z) / ray.z : 1e3;
    return [position.x + along * ray.x, position.y + along * ray.y];
  }

  // -- drawing --

  draw() {
    const now = performance.now() / 1000,
      { pen, width, height } = this;
    if (!width || !this.canvas.clientWidth) return;
    const isOnWay = this.place(now);
    this.drawn++;
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    if (this.world.scene.value) this.paint(now, this.goesOn ? now - this.last : 0);
    this.last = now;
    pen.setTransform(this.density, 0, 0, this.density, 0, 0);
    pen.lineCap = pen.lineJoin = "round";
    if (this.world.frame.value) this.write(now);
    if (this.mode.value === "eye") {
      const [across, down] = this.field.map((each) => each * this.focal);
      pen.fillStyle = "rgba(8, 12, 18, 0.55)";
      pen.beginPath();
      pen.rect(0, 0, width, height);
      pen.rect((width - across) / 2, (height - down) / 2, across, down);
      pen.fill("evenodd");
    }
    this.goesOn = isOnWay || this.world.isMoving(now);
    if (this.goesOn) this.invalidate();
  }

  /** Draw the picture, in the pixels of the canvas. *passed*: s since the last one, 0 if there was a rest. */
  protected abstract paint(now: number, passed: number): void;

  private write(now: number) {
    const mode = this.mode.value,
      { bits, count } = this.world.frame.value!,
      { radius, names } = this.world.scene.value!,
      poses = this.world.shown("robot", now);
    if (mode === "above" && !this.isSmall) this.writeScale();
    this.mark();
    for (const { name, points, colour } of this.isSmall || mode === "eye" ? [] : this.world.zones.value) {
      const [xs, ys] = [0, 1].map((k) => points.map((each) => each[k])),
        [left, top, scale] = this.toPixel((Math.min(...xs) + Math.max(...xs)) / 2, Math.max(...ys));
      if (scale > 0) this.text(name, left, top, colour, 11, false);
    }
    for (let k = 0; k < count; k++) {
      if (mode === "eye" && k === this.chosen) continue;
      const [x, y] = poses.subarray(3 * k),
        [left, top, scale] = this.toPixel(x, y, mode === "above" ? 0 : 0.072),
        size = radius * scale;
      const isOut = left < -size || left > this.width + size || top < -size || top > this.height + size;
      const isCut = bits[k] & FRAME.cut;
      if (isOut || !(scale > 0) || (size < 7 && !isCut)) continue;
      const name = (count > 8 || this.isSmall ? `${k + 1}` : names[k]) + (isCut ? ": link cut" : ""),
        isBelow = mode === "above" && top + size + 22 < this.height - (this.isSmall ? 0 : MARGIN.bottom),
        gap = mode !== "above" ? 0 : size + (this.world.selected.value?.key === `robot:${k}` ? 6 : 0),
        letters = Math.round(between(0.45 * size, 11, 14));
      this.text(name, left, isBelow ? top + gap : top - gap, isCut ? this.ink("bad") : this.hue(k), letters, isBelow);
    }
  }

  /** Write a text that can be read on every floor: it is kept as a picture, for letters take long to draw. */
  private text(text: string, left: number, top: number, colour: string, size: number, isBelow: boolean) {
    const key = `${text} ${colour} ${size}`;
    let made = this.texts.get(key);
    if (!made) {
      made = document.createElement("canvas");
      const pen = made.getContext("2d")!,
        font = `600 ${size}px ${getComputedStyle(this.canvas).fontFamily}`;
      pen.font = font;
      made.width = Math.ceil((pen.measureText(text).width + 6) * this.density);
      made.height = Math.ceil((size + 8) * this.density);
      pen.scale(this.density, this.density);
      Object.assign(pen, { font, textBaseline: "top", lineJoin: "round", lineWidth: 3, fillStyle: colour });
      pen.strokeStyle = this.ink("floor");
      pen.strokeText(text, 3, 4);
      pen.fillText(text, 3, 4);
      this.texts.set(key, made);
    }
    const [across, down] = [made.width / this.density, made.height / this.density];
    const at = between(left - across / 2, 0, Math.max(0, this.width - across));
    this.pen.drawImage(made, at, isBelow ? top : top - down, across, down);
  }

  /** Where the handle is that turns what is selected, pixels; null if there is none. */
  handle(): [left: number, top: number] | null {
    const thing = this.world.selected.value;
    if (!thing || !["robot", "box", "wall"].includes(thing.kind) || this.isSmall || this.mode.value === "eye")
      return null;
    const [x, y, angle] = this.shownPose(thing),
      far = this.world.reach(thing) + 26 / this.scale,
      [left, top] = this.toPixel(x + far * Math.cos(angle), y + far * Math.sin(angle));
    return [left, top];
  }

  private shownPose(thing: Place) {
    const { kind, index } = thing;
    if (kind !== "robot" && kind !== "box" && kind !== "cylinder") return this.world.pose(thing);
    return [...this.world.shown(kind, performance.now() / 1000).subarray(3 * index, 3 * index + 3)];
  }

  /** Mark what is selected: a ring around it on the floor, and a handle that turns it. */
  private mark() {
    const thing = this.world.selected.value,
      { pen } = this;
    if (!thing || (this.mode.value === "eye" && thing.kind === "robot")) return;
    const [x, y] = this.shownPose(thing),
      far = Math.max(this.world.reach(thing) + 5 / this.scale, 11 / this.scale);
    pen.beginPath();
    for (let k = 0; k <= 48; k++) {
      const [left, top] = this.toPixel(x + far * Math.cos((k * Math.PI) / 24), y + far * Math.sin((k * Math.PI) / 24));
      pen.lineTo(left, top);
    }
    pen.strokeStyle = this.ink("accent");
    pen.lineWidth = 2.5;
    pen.stroke();
    const handle = this.handle();
    if (!handle) return;
    pen.beginPath();
    pen.arc(...handle, 6, 0, 7);
    pen.fillStyle = this.ink("card");
    pen.fill();
    pen.stroke();
  }

  /** The metres along the edges of the map. */
  private writeScale() {
    const { pen } = this,
      { width, depth } = this.world.scene.value!,
      step = stepOf(this.scale, 64),
      [x0, y0] = this.toPixel(0, 0),
      low = Math.min(y0 + 8, this.height - 18),
      high = Math.max(x0 - 8, 28);
    const { font } = getComputedStyle(this.canvas);
    Object.assign(pen, { font, fillStyle: this.ink("faint"), strokeStyle: this.ink("room") });
    pen.lineWidth = this.zoom > 1 ? 3 : 0.01; // it may stand on the floor
    const write = (metres: number, left: number, top: number, unit = "") => {
      const text = Number(metres.toFixed(2)) + unit;
      pen.strokeText(text, left, top);
      pen.fillText(text, left, top);
    };
    [pen.textAlign, pen.textBaseline] = ["center", "top"];
    for (let x = 0, left = x0; x <= width + 1e-9; left = x0 + (x += step) * this.scale)
      if (left > 0 && left < this.width)
        write(x, Math.min(left, this.width - 20), low, x + step > width + 1e-9 ? " m" : "");
    [pen.textAlign, pen.textBaseline] = ["right", "middle"];
    for (let y = 0, top = y0; y <= depth + 1e-9; top = y0 - (y += step) * this.scale)
      if (top > 0 && top < low - 8) write(y, high, top);
  }
}
