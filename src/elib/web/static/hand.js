// The hand in the world: what the mouse, a finger or the keys take and put elsewhere.

const STEP = 0.01,
  LONG_STEP = 0.05; // m, for the arrow keys

/** @import { Drag } from "./model.js" */
/** @import { Part } from "./world.js" */

export class Hand {
  /** @param {Part} world the part whose canvas, model and arena it works on */
  constructor(world) {
    this.world = world;
    /** @type {Drag | null} */
    this.drag = null;
    const { canvas } = world;
    canvas.addEventListener("pointerdown", (event) => this.take(event));
    canvas.addEventListener("pointermove", (event) => this.pull(event));
    for (const name of ["pointerup", "pointercancel"])
      canvas.addEventListener(name, () => {
        this.drag = null;
        canvas.style.cursor = "";
      });
    canvas.addEventListener("keydown", (event) => this.press(event));
  }

  /** @param {PointerEvent} event */
  place(event) {
    const { left, top } = this.world.canvas.getBoundingClientRect();
    return this.world.arena.toWorld(event.clientX - left, event.clientY - top);
  }

  /** @param {PointerEvent} event @param {number} x @param {number} y */
  at(event, x, y) {
    return this.world.model.at(x, y, (event.pointerType === "touch" ? 20 : 9) / this.world.arena.scale);
  }

  /** @param {PointerEvent} event */
  take(event) {
    const { model, arena, canvas } = this.world;
    if (!model.frame || event.button !== 0) return;
    const [x, y] = this.place(event),
      thing = this.at(event, x, y);
    if (thing?.key !== arena.selected?.key) this.world.select(thing);
    if (!thing) return;
    const [left, low, angle] = model.pose(thing);
    this.drag = { thing, angle, dx: left - x, dy: low - y, fromX: event.clientX, fromY: event.clientY, isOn: false };
    canvas.setPointerCapture(event.pointerId);
  }

  /** @param {PointerEvent} event */
  pull(event) {
    const { model, canvas } = this.world,
      { drag } = this;
    if (!model.frame) return;
    const [x, y] = this.place(event);
    if (!drag) {
      canvas.style.cursor = this.at(event, x, y) ? "grab" : "";
      return;
    }
    if (!drag.isOn && Math.hypot(event.clientX - drag.fromX, event.clientY - drag.fromY) < 4) return;
    drag.isOn = true;
    canvas.style.cursor = "grabbing";
    // A robot that drives turns meanwhile; nobody wants it turned back.
    this.world.act(
      model.move(drag.thing, x + drag.dx, y + drag.dy, drag.thing.kind === "robot" ? undefined : drag.angle),
    );
  }

  /** @param {number} by */
  turn(by) {
    const { arena, model } = this.world;
    if (!arena.selected) return;
    const [x, y, angle] = model.pose(arena.selected);
    this.world.act(model.move(arena.selected, x, y, angle + by));
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    const { arena, model } = this.world;
    if (!model.frame || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = event.shiftKey ? LONG_STEP : STEP;
    /** @type {Record<string, [dx: number, dy: number]>} */
    const arrows = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
    if (event.key in arrows && arena.selected) {
      const [x, y, angle] = model.pose(arena.selected),
        [dx, dy] = arrows[event.key];
      this.world.act(model.move(arena.selected, x + dx, y + dy, arena.selected.kind === "robot" ? undefined : angle));
    } else if (event.key === "[") this.turn(Math.PI / 12);
    else if (event.key === "]") this.turn(-Math.PI / 12);
    else if (event.key === "n" || event.key === "p") this.step(event.key === "n" ? 1 : -1);
    else if (event.key === "Escape") this.world.select(null);
    else return;
    event.preventDefault();
  }

  /** @param {number} by */
  step(by) {
    const { list, model } = this.world,
      keys = [...list.options].map((option) => option.value);
    this.world.select(model.find(keys[(Math.max(0, keys.indexOf(list.value)) + by + keys.length) % keys.length]));
  }
}
