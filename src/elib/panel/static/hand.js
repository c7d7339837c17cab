// The hand in the world: what the mouse, fingers or the keys take, put elsewhere, or look at from nearer.

const STEP = 0.01,
  LONG_STEP = 0.05; // m, for the arrow keys
const PAN = 40; // pixels, for the arrow keys
const CLOSER = 1.3; // for a step of the wheel or a key
const SLOP = 4; // pixels that a pointer may move in a click

/** @import { Thing } from "./model.js" */
/** @import { Part } from "./world.js" */

/**
 * What a pointer holds: a thing, or the floor.
 * @typedef {object} Drag
 * @property {Thing | null} thing
 * @property {number} dx from the pointer to its middle, m
 * @property {number} dy
 * @property {number} fromX where the pointer took it, pixels
 * @property {number} fromY
 * @property {boolean} isOn the pointer has moved
 */

export class Hand {
  /** @param {Part} world the part whose canvas, model and arena it works on */
  constructor(world) {
    this.world = world;
    /** @type {Drag | null} */
    this.drag = null;
    /** @type {Map<number, [x: number, y: number]>} */
    this.pointers = new Map(); // those that are down; two of them pinch
    const { canvas } = world;
    canvas.addEventListener("pointerdown", (event) => this.take(event));
    canvas.addEventListener("pointermove", (event) => this.pull(event));
    for (const name of /** @type {const} */ (["pointerup", "pointercancel"]))
      canvas.addEventListener(name, (event) => this.release(event));
    canvas.addEventListener("wheel", (event) => this.roll(event), { passive: false });
    canvas.addEventListener("dblclick", (event) => {
      const thing = this.at(event, 9);
      if (thing?.kind === "robot") world.open(thing.index);
    });
    canvas.addEventListener("keydown", (event) => this.press(event));
  }

  /** @param {MouseEvent} event @returns {[x: number, y: number]} */
  pixel(event) {
    const { left, top } = this.world.canvas.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  }

  /** @param {MouseEvent} event @param {number} finger pixels */
  at(event, finger) {
    const { model, arena } = this.world;
    const [x, y] = arena.toWorld(...this.pixel(event));
    return model.frame ? model.at(x, y, finger / arena.scale) : null;
  }

  /** @param {PointerEvent} event */
  take(event) {
    const { model, arena, canvas } = this.world;
    if (!model.frame || event.button !== 0) return;
    canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, this.pixel(event));
    const thing = this.pointers.size > 1 ? null : this.at(event, event.pointerType === "touch" ? 20 : 9);
    if (thing && thing.key !== arena.selected?.key) this.world.select(thing);
    const [x, y] = arena.toWorld(...this.pixel(event)),
      [left, low] = thing ? model.pose(thing) : [x, y];
    this.drag = { thing, dx: left - x, dy: low - y, fromX: event.clientX, fromY: event.clientY, isOn: false };
  }

  /** @param {PointerEvent} event */
  pull(event) {
    const { model, arena, canvas } = this.world,
      { drag } = this,
      here = this.pixel(event),
      before = this.pointers.get(event.pointerId);
    if (!drag || !before) {
      canvas.style.cursor = this.at(event, 9) ? "pointer" : "";
      return;
    }
    if (this.pointers.size === 2) {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)?.[1] ?? here;
      /** @type {(one: number[], two: number[]) => number} */
      const apart = (one, two) => Math.max(10, Math.hypot(one[0] - two[0], one[1] - two[1]));
      arena.zoomBy(apart(here, other) / apart(before, other), (here[0] + other[0]) / 2, (here[1] + other[1]) / 2);
      arena.panBy((here[0] - before[0]) / 2, (here[1] - before[1]) / 2);
      drag.isOn = true;
    }
    this.pointers.set(event.pointerId, here);
    if (!drag.isOn && Math.hypot(event.clientX - drag.fromX, event.clientY - drag.fromY) < SLOP) return;
    drag.isOn = true;
    canvas.style.cursor = "grabbing";
    if (this.pointers.size > 1) return;
    if (!drag.thing) {
      this.world.follow(null);
      arena.panBy(here[0] - before[0], here[1] - before[1]);
      arena.draw();
      return;
    }
    const [x, y] = arena.toWorld(...here);
    this.world.act(model.move(drag.thing, x + drag.dx, y + drag.dy));
  }

  /** @param {PointerEvent} event */
  release(event) {
    this.pointers.delete(event.pointerId);
    if (this.drag && !this.drag.thing && !this.drag.isOn) this.world.select(null);
    if (!this.pointers.size) this.drag = null;
    this.world.canvas.style.cursor = "";
  }

  /** @param {WheelEvent} event */
  roll(event) {
    event.preventDefault();
    const notches = Math.max(-3, Math.min(3, event.deltaY / (event.deltaMode ? 3 : 100)));
    this.world.zoom(CLOSER ** -notches, ...this.pixel(event));
  }

  /** @param {number} by rad */
  turn(by) {
    const { arena, model } = this.world;
    if (!arena.selected) return;
    const [x, y, angle] = model.pose(arena.selected);
    this.world.act(model.move(arena.selected, x, y, angle + by));
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    const { world } = this;
    if (!world.model.frame || event.ctrlKey || event.metaKey || event.altKey) return;
    /** @type {Record<string, () => void>} */
    const keys = {
      ArrowLeft: () => this.shift(-1, 0, event.shiftKey),
      ArrowRight: () => this.shift(1, 0, event.shiftKey),
      ArrowUp: () => this.shift(0, 1, event.shiftKey),
      ArrowDown: () => this.shift(0, -1, event.shiftKey),
      "[": () => this.turn(Math.PI / 12),
      "]": () => this.turn(-Math.PI / 12),
      n: () => this.next(1),
      p: () => this.next(-1),
      "+": () => world.zoom(CLOSER),
      "-": () => world.zoom(1 / CLOSER),
      0: () => world.showAll(),
      b: () => world.add("box"),
      m: () => world.add("wall"),
      Delete: () => world.remove(),
      Escape: () => world.select(null),
    };
    const act = keys[event.key];
    // W A S D drive, and arrows the robot of this page.
    if (!act || (world.isOwnSelected && event.key.startsWith("Arrow"))) return;
    act();
    event.preventDefault();
    event.stopPropagation();
  }

  /** @param {number} right @param {number} up @param {boolean} isLong */
  shift(right, up, isLong) {
    const { arena, model } = this.world,
      step = isLong ? LONG_STEP : STEP;
    if (!arena.selected) {
      arena.panBy(-PAN * right, PAN * up);
      arena.draw();
      return;
    }
    const [x, y] = model.pose(arena.selected);
    this.world.act(model.move(arena.selected, x + right * step, y + up * step));
  }

  /** @param {number} by */
  next(by) {
    const { list, model } = this.world,
      keys = [...list.options].map((option) => option.value);
    this.world.select(model.find(keys[(Math.max(0, keys.indexOf(list.value)) + by + keys.length) % keys.length]));
  }
}
