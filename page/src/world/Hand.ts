// The hand in the world: what the mouse, fingers or the keys take, put elsewhere, turn, or look at from nearer.
import type { Orders } from "./orders";
import { MODES, type Thing } from "./scene";
import type { Stage } from "./Stage";

const STEP = 0.01,
  LONG_STEP = 0.05; // m, for the arrow keys
const PAN = 40; // pixels, for the arrow keys
const TURN = Math.PI / 12;
const CLOSER = 1.3; // for a step of the wheel or a key
const SLOP = 4; // pixels that a pointer may move in a click
const HEIGHTS = [0.12, 0.08, 0.05, 0.025, 0]; // m: where a ray through the pointer may meet a thing

type Point = [left: number, top: number];
/** What a pointer holds: a thing at a height, the handle that turns it, or the floor. */
type Drag = { thing: Thing | null; turns: boolean; z: number; dx: number; dy: number; from: Point; isOn: boolean };

export class Hand {
  private drag: Drag | null = null;
  private pointers = new Map<number, Point>(); // those that are down; two of them pinch
  private ending = new AbortController();

  constructor(
    private readonly stage: Stage,
    private readonly orders: Orders,
    private readonly open: (robot: number) => void,
  ) {
    const options = { signal: this.ending.signal, passive: false },
      on = <Name extends keyof HTMLElementEventMap>(name: Name, act: (event: HTMLElementEventMap[Name]) => void) =>
        stage.canvas.addEventListener(name, act, options);
    on("pointerdown", (event) => this.take(event));
    on("pointermove", (event) => this.pull(event));
    on("pointerup", (event) => this.release(event));
    on("pointercancel", (event) => this.release(event));
    on("wheel", (event) => this.roll(event));
    on("contextmenu", (event) => event.preventDefault());
    on("keydown", (event) => this.press(event));
    on("dblclick", (event) => {
      const thing = this.at(event, 9)?.thing;
      if (thing?.kind === "robot") this.open(thing.index);
    });
  }

  close() {
    this.ending.abort();
  }

  private pixel(event: MouseEvent): Point {
    const { left, top } = this.stage.canvas.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  }

  /** What is under the pointer, and at which height it is taken. *finger*: its radius, pixels. */
  private at(event: MouseEvent, finger: number) {
    const { world, scale, mode } = this.stage;
    if (!world.frame.value) return null;
    for (const z of mode.value === "above" ? [0] : HEIGHTS) {
      const thing = world.at(...this.stage.toFloor(...this.pixel(event), z), finger / scale, z);
      if (thing) return { thing, z };
    }
    return null;
  }

  private isOnHandle(event: MouseEvent, finger: number) {
    const handle = this.orders.mayEdit && this.stage.handle(),
      [left, top] = this.pixel(event);
    return handle && Math.hypot(handle[0] - left, handle[1] - top) < finger;
  }

  private take(event: PointerEvent) {
    const { stage } = this,
      { world } = stage,
      finger = event.pointerType === "touch" ? 20 : 9;
    if (!world.frame.value || event.button === 1) return;
    stage.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, this.pixel(event));
    const isAlone = this.pointers.size === 1 && event.button === 0,
      turns = isAlone && this.isOnHandle(event, finger + 3),
      found = isAlone && !turns ? this.at(event, finger) : null,
      thing = turns ? world.selected.value : (found?.thing ?? null),
      z = found?.z ?? 0;
    if (thing && thing.key !== world.selected.value?.key) world.select(thing);
    const [x, y] = stage.toFloor(...this.pixel(event), z),
      [left, low] = thing ? world.pose(thing) : [x, y];
    this.drag = { thing, turns: !!turns, z, dx: left - x, dy: low - y, from: this.pixel(event), isOn: false };
  }

  private pull(event: PointerEvent) {
    const { stage, drag } = this,
      here = this.pixel(event),
      before = this.pointers.get(event.pointerId);
    if (!drag || !before) {
      stage.canvas.style.cursor = this.isOnHandle(event, 12) ? "grab" : this.at(event, 9) ? "pointer" : "";
      return;
    }
    if (this.pointers.size === 2) {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)?.[1] ?? here,
        apart = (one: Point) => Math.max(10, Math.hypot(one[0] - other[0], one[1] - other[1]));
      stage.zoomBy(apart(here) / apart(before), (here[0] + other[0]) / 2, (here[1] + other[1]) / 2);
      stage.panBy((here[0] - before[0]) / 2, (here[1] - before[1]) / 2);
      drag.isOn = true;
    }
    this.pointers.set(event.pointerId, here);
    if (!drag.isOn && Math.hypot(here[0] - drag.from[0], here[1] - drag.from[1]) < SLOP) return;
    drag.isOn = true;
    stage.canvas.style.cursor = "grabbing";
    if (this.pointers.size > 1) return;
    const { world } = stage;
    if (!drag.thing) {
      const isPan = stage.mode.value === "above" || event.buttons === 2 || event.shiftKey;
      if (isPan) stage.followed.value = null;
      if (isPan) stage.panBy(here[0] - before[0], here[1] - before[1]);
      else stage.orbitBy(here[0] - before[0], here[1] - before[1]);
      return;
    }
    if (!this.orders.mayEdit) return;
    const [x, y] = stage.toFloor(...here, drag.z),
      [left, low] = world.pose(drag.thing);
    if (drag.turns) this.orders.act(world.move(drag.thing, left, low, Math.atan2(y - low, x - left)));
    else this.orders.act(world.move(drag.thing, x + drag.dx, y + drag.dy));
  }

  private release(event: PointerEvent) {
    this.pointers.delete(event.pointerId);
    if (this.drag && !this.drag.thing && !this.drag.isOn) this.stage.world.select(null);
    if (!this.pointers.size) this.drag = null;
    this.stage.canvas.style.cursor = "";
  }

  private roll(event: WheelEvent) {
    event.preventDefault();
    const notches = Math.max(-3, Math.min(3, event.deltaY / (event.deltaMode ? 3 : 100)));
    this.stage.zoomBy(CLOSER ** -notches, ...this.pixel(event));
  }

  /** Turn what is selected. */
  turn(by: number) {
    this.move(0, 0, by);
  }

  private move(right: number, up: number, by?: number) {
    const { world } = this.stage,
      thing = world.selected.value;
    if (!thing || !this.orders.mayEdit) return;
    const [x, y, angle] = world.pose(thing);
    this.orders.act(world.move(thing, x + right, y + up, by === undefined ? by : angle + by));
  }

  private press(event: KeyboardEvent) {
    const { stage } = this,
      { world } = stage;
    if (!world.frame.value || event.ctrlKey || event.metaKey || event.altKey) return;
    const keys: Record<string, () => unknown> = {
      ArrowLeft: () => this.shift(-1, 0, event.shiftKey),
      ArrowRight: () => this.shift(1, 0, event.shiftKey),
      ArrowUp: () => this.shift(0, 1, event.shiftKey),
      ArrowDown: () => this.shift(0, -1, event.shiftKey),
      "[": () => this.turn(TURN),
      "]": () => this.turn(-TURN),
      n: () => this.next(1),
      p: () => this.next(-1),
      v: () => stage.isFlat || (stage.mode.value = MODES[(MODES.indexOf(stage.mode.value) + 1) % 3]),
      "+": () => stage.zoomBy(CLOSER),
      "-": () => stage.zoomBy(1 / CLOSER),
      0: () => stage.showAll(),
      b: () => this.orders.add("box", stage.middle),
      m: () => this.orders.add("wall", stage.middle),
      Delete: () => this.orders.remove(),
      Escape: () => world.select(null),
    };
    const act = keys[event.key],
      isOwn = world.selected.value?.key === `robot:${world.own}`;
    // W A S D drive, and arrows the robot of this page.
    if (!act || (isOwn && event.key.startsWith("Arrow"))) return;
    act();
    event.preventDefault();
    event.stopPropagation();
  }

  private shift(right: number, up: number, isLong: boolean) {
    const step = isLong ? LONG_STEP : STEP;
    if (this.stage.world.selected.value) this.move(right * step, up * step);
    else this.stage.panBy(-PAN * right, PAN * up);
  }

  private next(by: number) {
    const { world } = this.stage,
      all = [null, ...world.all()],
      at = all.findIndex((each) => each?.key === world.selected.value?.key);
    world.select(all[(at + by + all.length) % all.length]);
  }
}
