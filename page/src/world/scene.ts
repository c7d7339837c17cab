// What the page knows of a virtual world: the scene as it was sent, its changes, and its frames. It knows no DOM.
import { batch, signal } from "@preact/signals";
import { FRAME, type Asked, type Box, type Change, type Clock, type Cylinder, type Light } from "../messages";
import type { NewScene, Readings, Scene, Sound, Zone } from "../messages";
import { hello } from "../store";

const KEPT = 60; // s of the world: how long it can go back

/** From where a world is looked at. */
export const MODES = ["above", "orbit", "eye"] as const;
export type Mode = (typeof MODES)[number];

const TRAIL_STEP = 0.004; // m between two points of a trail
const TRAIL_POINTS = 500; // of one robot: its last two metres or more
const ALL_POINTS = 20_000; // of all robots
const PEN_POINTS = 5_000; // of what one pen draws while a page looks
const LIFTED = 0.15; // m between two frames: it was put elsewhere, and did not drive there
const FASTEST = 0.2; // m/s: what moved farther was lifted, however long the page had slept
const SMOOTH = 0.1; // s of the robot's time over which speeds are smoothed
const MAX_LISTED = 500; // things of a kind in the list
const THICK = 0.006; // m: how a wall is shown

export type Kind = "robot" | "cylinder" | "box" | "wall" | "light" | "sound";
export type Place = { kind: Kind; index: number };
/** What can be selected and moved. */
export type Thing = Place & { key: string; name: string };
export type Pose = [x: number, y: number, angle: number];
/** A wall is a long, thin box. */
type Things = { wall: Omit<Box, "pushable">[]; box: Box[]; cylinder: Cylinder[]; light: Light[]; sound: Sound[] };
export type Frame = ReturnType<typeof decode>;
/** What a world was at a moment. Of what a page has seen nothing is changed, only replaced. */
type Moment = { frame: Frame | null; things: Things; ambient: number };

const KINDS: Kind[] = ["robot", "cylinder", "box", "wall", "light", "sound"];
/** A request, with its name at `do`. */
export type Order = { [Name in keyof Asked]: { do: Name } & Asked[Name] }[keyof Asked];

const UNDER_POINTER: Kind[] = ["robot", "light", "sound", "cylinder", "box", "wall"]; // what is small first
const NOTHING: Things = { wall: [], box: [], cylinder: [], light: [], sound: [] };

const LOOKS = ["poses", "bits", "ring", "rays"] as const; // what is seen of a frame

const isEqual = (one: ArrayLike<number> | null, other: ArrayLike<number> | null) =>
  one?.length === other?.length && (!one || Array.prototype.every.call(one, (each, k) => each === other![k]));

const wrapped = (angle: number) => Math.atan2(Math.sin(angle), Math.cos(angle));

const wallsOf = (walls: Scene["walls"]): Things["wall"] =>
  walls.map(([x1, y1, x2, y2, colour, height, face]) => {
    const [dx, dy] = [x2 - x1, y2 - y1],
      [x, y, angle] = [x1 + dx / 2, y1 + dy / 2, Math.atan2(dy, dx)];
    return { name: "", x, y, angle, width: Math.hypot(dx, dy) + THICK, depth: THICK, height, colour, face };
  });

/** An angle in whole degrees, 0 to 359. */
export function degrees(angle: number) {
  const whole = Math.round((angle * 180) / Math.PI) % 360;
  return whole < 0 ? whole + 360 : whole + 0; // no minus before nothing
}

/** Take a frame apart: one number after the other, in the order of the robots, as server/world.py writes it. */
export function decode(buffer: ArrayBuffer) {
  const head = new DataView(buffer),
    count = head.getUint32(16, true),
    flags = head.getUint32(4, true),
    hasRays = (flags & FRAME.rays) !== 0;
  const raysAt = FRAME.header + 12 * count,
    bitsAt = raysAt + (hasRays ? 160 * count : 0);
  return {
    number: head.getUint32(0, true),
    isKept: (flags & FRAME.kept) !== 0,
    time: head.getFloat64(8, true),
    count,
    poses: new Float32Array(buffer, FRAME.header, 3 * count),
    rays: hasRays ? new Float32Array(buffer, raysAt, 40 * count) : null,
    bits: new Uint8Array(buffer, bitsAt, count),
    ring: new Uint8Array(buffer, bitsAt + count, 24 * count),
  };
}

/** Poses between two messages: on their way from where they were shown when the newest came to where that puts them. */
class Glide {
  private from: Float32Array = new Float32Array(0);
  private to: Float32Array = new Float32Array(0);
  private shown = new Float32Array(0);
  private since = 0;
  private span = 0;

  aim(to: Float32Array, now: number, span: number) {
    this.from = to.length === this.to.length ? this.at(now).slice() : to;
    this.to = to;
    this.shown = new Float32Array(to.length);
    this.since = now;
    this.span = this.from.some((each, k) => Math.abs(each - to[k]) > 1e-5) ? span : 0;
  }

  isMoving(now: number) {
    return now < this.since + this.span;
  }

  at(now: number) {
    if (!this.isMoving(now)) return this.to;
    const { from, to, shown } = this,
      rest = 1 - (now - this.since) / this.span;
    for (let k = 0; k < to.length; k += 3) {
      const [dx, dy] = [from[k] - to[k], from[k + 1] - to[k + 1]],
        part = Math.hypot(dx, dy) < LIFTED ? rest : 0;
      shown[k] = to[k] + part * dx;
      shown[k + 1] = to[k + 1] + part * dy;
      shown[k + 2] = to[k + 2] + part * wrapped(from[k + 2] - to[k + 2]);
    }
    return shown;
  }
}

/** The same list, with changes to some of its things. */
const changed = <T>(list: T[], changes: [index: number, change: Partial<T>][]) => {
  if (!changes.length) return list;
  const found = list.slice();
  for (const [k, change] of changes) found[k] = { ...found[k], ...change };
  return found;
};

export class World {
  readonly scene = signal<Scene | null>(null);
  readonly isLive = signal(false); // the scene is one of now, and not what was seen last
  readonly things = signal(NOTHING); // another object whenever anything in it has changed
  readonly zones = signal<Zone[]>([]); // another list whenever one was switched on or off
  readonly ambient = signal(0);
  readonly clock = signal<Clock>({ paused: false, speed: 1, fixed: "" });
  readonly frame = signal<Frame | null>(null);
  readonly looks = signal<Frame | null>(null); // the last frame that looks otherwise than the one before it
  readonly readings = signal<Readings | null>(null);
  readonly selected = signal<Thing | null>(null);
  own: number | null = null; // the robot that the place of the page is about
  readonly past = signal<number | null>(null); // s: the moment that is shown; null for now
  readonly span = signal<[first: number, last: number]>([0, 0]); // s: the moments that can be shown
  trails: [x: number, y: number][][] = [];
  lines: [x: number, y: number][][] = []; // that pens drew
  speeds = new Float32Array(0); // m/s and rad/s of each robot
  private glides = { robot: new Glide(), box: new Glide(), cylinder: new Glide() };
  private beats: [here: number, simulated: number][] = []; // of the last two seconds
  private gap = 0.04; // s between two frames
  private now: Moment = { frame: null, things: NOTHING, ambient: 0 };
  private moments: Moment[] = []; // of the last minute
  private added = ""; // the key of a thing that will be selected as soon as it is here
  of = ""; // the key by which the page has asked for it

  /** Be the world of a key from now on: what was seen of another is gone. */
  open(of: string) {
    if (of !== this.of) this.scene.value = null;
    this.of = of;
  }

  /** Take what the server tells; a scene of null leaves the last one as it was. */
  take(message: NewScene | Change | Readings) {
    if (message.type === "readings") this.readings.value = message;
    else if (message.type === "change") this.change(message);
    else if (message.scene) this.enter(message.scene);
    else this.isLive.value = false;
  }

  enter(scene: Scene) {
    const { walls, boxes: box, cylinders: cylinder, lights: light, sounds: sound } = scene;
    [this.trails, this.lines] = [1, 2].map(() => Array.from({ length: scene.robots }, () => []));
    this.speeds = new Float32Array(2 * scene.robots);
    this.beats = [];
    this.moments = [];
    this.now = { frame: null, things: { wall: wallsOf(walls), box, cylinder, light, sound }, ambient: scene.ambient };
    batch(() => {
      this.frame.value = this.looks.value = this.readings.value = this.past.value = null;
      this.things.value = this.now.things;
      this.ambient.value = scene.ambient;
      this.zones.value = scene.zones;
      this.clock.value = scene.clock;
      this.scene.value = scene;
      this.isLive.value = true;
      this.select(null);
    });
    this.aim();
  }

  private change(change: Change) {
    if (!this.scene.value) return;
    const { boxes = [], cylinders = [], lights = [], sounds = [], walls, all_boxes, ambient } = change,
      { wall, box, cylinder, light, sound } = this.now.things;
    const things: Things = {
      wall: walls ? wallsOf(walls) : wall,
      box: changed(
        all_boxes ?? box,
        boxes.map(([k, x, y, angle]) => [k, { x, y, angle }]),
      ),
      cylinder: changed(
        cylinder,
        cylinders.map(([k, x, y]) => [k, { x, y }]),
      ),
      light: changed(light, lights),
      sound: changed(sound, sounds),
    };
    this.now = { ...this.now, things, ambient: ambient ?? this.now.ambient };
    batch(() => {
      if (change.zones) this.zones.value = change.zones;
      if (change.clock) [this.clock.value, this.beats] = [change.clock, []];
      if (this.past.value === null) this.place(this.now);
    });
  }

  /** Let things be as they were at a moment. */
  private place({ things, ambient }: Moment) {
    const isOther = things.wall !== this.things.value.wall || things.box.length !== this.things.value.box.length;
    this.things.value = things;
    this.ambient.value = ambient;
    if (isOther) {
      this.select(this.find(this.added) ?? this.find(this.selected.value?.key ?? ""));
      this.added = "";
    }
    this.aim();
  }

  private aim() {
    const { box, cylinder } = this.things.value,
      now = performance.now() / 1000;
    this.glides.box.aim(new Float32Array(box.flatMap(({ x, y, angle }) => [x, y, angle])), now, this.gap);
    this.glides.cylinder.aim(new Float32Array(cylinder.flatMap(({ x, y }) => [x, y, 0])), now, this.gap);
  }

  takeFrame(buffer: ArrayBuffer) {
    const frame = decode(buffer);
    if (frame.count !== this.scene.value?.robots) return;
    const old = this.now.frame,
      now = performance.now() / 1000,
      last = this.beats.at(-1);
    if (last) this.gap += 0.1 * (Math.min(0.25, Math.max(0.01, now - last[0])) - this.gap);
    if (old && frame.time > old.time) this.measure(old, frame);
    const limit = Math.min(TRAIL_POINTS, ALL_POINTS / frame.count),
      far = LIFTED + FASTEST * (frame.time - (old?.time ?? frame.time));
    for (let k = 0; k < frame.count; k++) {
      const [x, y] = frame.poses.subarray(3 * k);
      this.follow(this.trails[k], x, y, limit, LIFTED);
      if (this.scene.value.pens[k]) this.follow(this.lines[k], x, y, PEN_POINTS, far);
    }
    this.beats.push([now, frame.time]);
    while (this.beats.length > 2 && now - this.beats[0][0] > 2) this.beats.shift();
    this.now = { ...this.now, frame };
    batch(() => {
      this.keep(frame);
      if (this.past.value === null) this.show(frame);
      else this.lookAt(this.past.value);
    });
  }

  /** Keep what the world is now, if it can go back to it. */
  private keep({ time, isKept }: Frame) {
    const { moments } = this,
      timeOf = (at: number) => moments.at(at)?.frame?.time ?? time;
    if (timeOf(-1) > time) moments.length = 0; // the world began again
    if (moments.length && timeOf(-1) === time) moments.pop(); // a hand may have moved something since
    if (isKept) moments.push(this.now);
    while (timeOf(0) < time - KEPT) moments.shift();
    if (moments.length) this.span.value = [timeOf(0), time];
  }

  /** Show what the world was at a time, as near to it as it is known; null for what it is now. */
  lookAt(time: number | null) {
    const { moments } = this,
      isPast = time !== null && moments.length > 0,
      moment = isPast ? (moments.findLast(({ frame }) => frame!.time <= time) ?? moments[0]) : this.now;
    batch(() => {
      this.past.value = isPast ? moment.frame!.time : null;
      if (moment.things !== this.things.value || moment.ambient !== this.ambient.value) this.place(moment);
      if (moment.frame && moment.frame !== this.frame.value) this.show(moment.frame);
    });
  }

  private show(frame: Frame) {
    const old = this.frame.value,
      isSame = old && LOOKS.every((part) => isEqual(old[part], frame[part]));
    this.frame.value = frame;
    if (isSame) return;
    this.glides.robot.aim(frame.poses, performance.now() / 1000, this.gap);
    this.looks.value = frame;
  }

  /** How fast each robot moves, from two frames, smoothed: however far they are apart, one that stands shows so soon. */
  private measure(old: Frame, { count, poses, time }: Frame) {
    const span = time - old.time,
      share = 1 - Math.exp(-span / SMOOTH);
    for (let k = 0; k < count; k++) {
      const [x, y, heading] = poses.subarray(3 * k),
        [oldX, oldY, oldHeading] = old.poses.subarray(3 * k);
      const along = ((x - oldX) * Math.cos(heading) + (y - oldY) * Math.sin(heading)) / span;
      this.speeds[2 * k] += share * (along - this.speeds[2 * k]);
      this.speeds[2 * k + 1] += share * (wrapped(heading - oldHeading) / span - this.speeds[2 * k + 1]);
    }
  }

  private follow(trail: [number, number][], x: number, y: number, limit: number, far: number) {
    const last = trail.at(-1),
      moved = last ? Math.hypot(x - last[0], y - last[1]) : 1;
    if (moved < TRAIL_STEP) return;
    if (last && moved > far) trail.length = 0; // or the page had slept: no line through the air
    trail.push([x, y]);
    if (trail.length > limit) trail.shift();
  }

  /** Simulated seconds in one of the wall clock; null before it can be told. */
  get ratio() {
    const first = this.beats[0],
      last = this.beats.at(-1);
    return last && last[0] - first[0] > 1 ? (last[1] - first[1]) / (last[0] - first[0]) : null;
  }

  // -- things --

  select(thing: Thing | null) {
    if (thing?.key !== this.selected.value?.key) this.readings.value = null;
    this.selected.value = thing;
  }

  /** Select a thing that was just added: now, or as soon as it is here. */
  selectAdded(key: string) {
    const thing = this.find(key);
    if (thing) this.select(thing);
    else this.added = key;
  }

  count(kind: Kind) {
    return kind === "robot" ? (this.scene.value?.robots ?? 0) : this.things.value[kind].length;
  }

  /** Everything that can be selected. */
  all() {
    return KINDS.flatMap((kind) =>
      Array.from({ length: Math.min(MAX_LISTED, this.count(kind)) }, (_, index) => this.thing(kind, index)),
    );
  }

  thing(kind: Kind, index: number): Thing {
    const own = kind === "robot" ? this.scene.value?.names[index] : this.things.value[kind][index]?.name,
      title = { cylinder: "post", light: "lamp" }[kind as string] ?? kind;
    return { kind, index, key: `${kind}:${index}`, name: own || `${title} ${index + 1}` };
  }

  /** The thing of a key such as "robot:0"; null if there is none. */
  find(key: string) {
    const [kind, index] = key.split(":") as [Kind, string];
    return index && Number(index) < this.count(kind) ? this.thing(kind, Number(index)) : null;
  }

  /** Whether anything is still on its way to where the last message put it. */
  isMoving(now: number) {
    return Object.values(this.glides).some((each) => each.isMoving(now));
  }

  /** Where all things of a kind are shown at a moment: x, y and angle of one after the other. */
  shown(kind: "robot" | "box" | "cylinder", now: number) {
    return this.glides[kind].at(now);
  }

  private what({ kind, index }: Place) {
    if (kind === "robot") return { radius: this.scene.value?.radius ?? 0, height: hello.value!.body.height };
    return this.things.value[kind][index] ?? { x: 0, y: 0 }; // it was just removed
  }

  /** Where a thing is and how it is turned. */
  pose(thing: Place): Pose {
    const what = this.what(thing);
    if ("x" in what) return [what.x, what.y, "angle" in what ? what.angle : 0];
    const [x = 0, y = 0, heading = 0] = this.frame.value?.poses.subarray(3 * thing.index) ?? [];
    return [x, y, heading];
  }

  /** The radius of the circle around a thing, m. */
  reach(thing: Place) {
    const what = this.what(thing);
    return "depth" in what ? Math.hypot(what.width, what.depth) / 2 : "radius" in what ? what.radius : 0;
  }

  /** The thing at a place, robots first; null if there is none. *finger*: its radius, m; *above*: m over the floor. */
  at(x: number, y: number, finger: number, above = 0) {
    for (const kind of UNDER_POINTER) {
      let best: number | null = null,
        nearest = Infinity;
      for (let index = 0; index < this.count(kind); index++) {
        const [left, low] = this.pose({ kind, index }),
          far = Math.hypot(x - left, y - low);
        if (far < nearest && this.isOn({ kind, index }, x, y, finger, above)) [best, nearest] = [index, far];
      }
      if (best !== null) return this.thing(kind, best);
    }
    return null;
  }

  private isOn(thing: Place, x: number, y: number, finger: number, above: number) {
    const what = this.what(thing),
      [left, low, angle] = this.pose(thing),
      [right, up, c, s] = [x - left, y - low, Math.cos(angle), Math.sin(angle)],
      more = thing.kind === "wall" ? finger : 0;
    if (Math.hypot(right, up) > Math.max(this.reach(thing), finger) || above > ("height" in what ? what.height : 0))
      return false;
    if (!("depth" in what)) return true;
    return (
      Math.abs(right * c + up * s) <= what.width / 2 + more && Math.abs(up * c - right * s) <= what.depth / 2 + more
    );
  }

  /** The order that puts a thing elsewhere; without an angle it stays turned as it is. */
  move(thing: Place, x: number, y: number, angle?: number): Order {
    const { kind, index } = thing;
    if (kind === "robot") return { do: "move_robot", robot: index, x, y, heading: angle };
    if (kind === "box") return { do: "move_box", box: index, x, y, angle };
    if (kind === "cylinder") return { do: "move_cylinder", cylinder: index, x, y };
    if (kind === "light") return { do: "set_light", light: index, x, y };
    if (kind === "sound") return { do: "set_sound", sound: index, x, y };
    const half = (this.things.value.wall[index].width - THICK) / 2,
      turned = angle ?? this.pose(thing)[2],
      [dx, dy] = [half * Math.cos(turned), half * Math.sin(turned)];
    return { do: "move_wall", wall: index, x1: x - dx, y1: y - dy, x2: x + dx, y2: y + dy };
  }
}
