// What the page knows of a virtual world: the scene as it was sent, its changes, and the frames.

const TRAIL_LENGTH = 500; // points, at least 4 mm apart: the last two metres or more
const TRAIL_STEP = 0.004; // m
const MAX_TRAILS = 200; // robots that leave one
const MAX_LISTED = 500; // things of a kind in the list
const SMOOTH = 0.1; // s of the robot's time over which speeds are smoothed

/** @import { Box, Change, Cylinder, Frame, Light, Readings, Request, Scene, Sound, Wall, Walls } from "./frames.js" */
/** @import { Point } from "./robotshape.js" */

/**
 * What can be selected and moved.
 * @typedef {"robot" | "cylinder" | "box" | "wall" | "light" | "sound"} Kind
 * @typedef {{ kind: Kind, index: number }} Place where it is in the scene
 * @typedef {Place & { key: string, name: string }} Thing
 */

/** @type {Record<Kind, string>} */
const TITLES = { robot: "robot", cylinder: "post", box: "box", wall: "wall", light: "lamp", sound: "sound" };
const KINDS = /** @type {Kind[]} */ (Object.keys(TITLES));
/** @type {Kind[]} */
const UNDER_POINTER = ["robot", "light", "sound", "cylinder", "box", "wall"]; // what is small first

/** @param {Walls} walls @returns {Wall[]} */
const wallsOf = (walls) => walls.map(([x1, y1, x2, y2, colour]) => ({ x1, y1, x2, y2, colour }));

/**
 * An angle in whole degrees, 0 to 359.
 * @param {number} angle
 */
export function degrees(angle) {
  const whole = Math.round((angle * 180) / Math.PI) % 360;
  return whole < 0 ? whole + 360 : whole + 0; // no minus before nothing
}

export class Model {
  constructor() {
    /** @type {Scene | null} */
    this.scene = null;
    /** @type {Frame | null} */
    this.frame = null;
    /** @type {Readings | null} */
    this.readings = null;
    /** @type {{ wall: Wall[], box: Box[], cylinder: Cylinder[], light: Light[], sound: Sound[] }} */
    this.things = { wall: [], box: [], cylinder: [], light: [], sound: [] };
    /** @type {Point[][]} */
    this.trails = [];
    /** @type {[here: number, simulated: number][]} */
    this.clock = []; // of the last two seconds
    this.speeds = new Float32Array(0); // m/s and rad/s of each robot
  }

  /** The scene, for all that is only asked for once it has come. */
  get known() {
    if (!this.scene) throw new Error("no scene has come yet");
    return this.scene;
  }

  /** @param {Scene} scene */
  setScene(scene) {
    this.scene = scene;
    this.frame = this.readings = null;
    this.things = {
      wall: wallsOf(scene.walls),
      box: scene.boxes,
      cylinder: scene.cylinders,
      light: scene.lights,
      sound: scene.sounds,
    };
    this.trails = Array.from({ length: Math.min(scene.robots, MAX_TRAILS) }, () => []);
    this.clock = [];
    this.speeds = new Float32Array(2 * scene.robots);
  }

  /** @param {Change} change */
  change(change) {
    const { things, known } = this;
    if (change.all_boxes) things.box = change.all_boxes;
    if (change.walls) things.wall = wallsOf(change.walls);
    for (const [k, x, y, angle] of change.boxes ?? []) Object.assign(things.box[k], { x, y, angle });
    for (const [k, x, y] of change.cylinders ?? []) Object.assign(things.cylinder[k], { x, y });
    for (const [k, light] of change.lights ?? []) things.light[k] = light;
    for (const [k, sound] of change.sounds ?? []) things.sound[k] = sound;
    known.ambient = change.ambient ?? known.ambient;
    known.clock = change.clock ?? known.clock;
  }

  /** @param {Frame} frame @param {number} seconds of this computer's clock */
  setFrame(frame, seconds) {
    const old = this.frame;
    this.frame = frame;
    if (old && frame.time > old.time) this.measure(old, frame);
    this.trails.forEach((trail, k) => this.follow(trail, frame.poses[3 * k], frame.poses[3 * k + 1]));
    this.clock.push([seconds, frame.time]);
    while (this.clock.length > 2 && seconds - this.clock[0][0] > 2) this.clock.shift();
  }

  /**
   * How fast each robot moves, from two frames, smoothed: however far they are apart, one that stands shows so soon.
   * @param {Frame} old
   * @param {Frame} frame
   */
  measure(old, frame) {
    const span = frame.time - old.time,
      share = 1 - Math.exp(-span / SMOOTH);
    for (let k = 0; k < frame.count; k++) {
      const [x, y, heading] = frame.poses.subarray(3 * k);
      const along =
        ((x - old.poses[3 * k]) * Math.cos(heading) + (y - old.poses[3 * k + 1]) * Math.sin(heading)) / span;
      const turned = heading - old.poses[3 * k + 2];
      const rate = Math.atan2(Math.sin(turned), Math.cos(turned)) / span;
      this.speeds[2 * k] += share * (along - this.speeds[2 * k]);
      this.speeds[2 * k + 1] += share * (rate - this.speeds[2 * k + 1]);
    }
  }

  /** @param {Point[]} trail @param {number} x @param {number} y */
  follow(trail, x, y) {
    const last = trail[trail.length - 1];
    const moved = last ? Math.hypot(x - last[0], y - last[1]) : 1;
    if (moved < TRAIL_STEP) return;
    if (last && moved > 0.1) trail.length = 0; // it was lifted, or the page had slept: no line through the air
    trail.push([x, y]);
    if (trail.length > TRAIL_LENGTH) trail.shift();
  }

  /** Simulated seconds in one of the wall clock; null before it can be told. */
  get ratio() {
    const first = this.clock[0],
      last = this.clock[this.clock.length - 1];
    return first && last[0] - first[0] > 1 ? (last[1] - first[1]) / (last[0] - first[0]) : null;
  }

  /** @param {Kind} kind */
  count(kind) {
    return kind === "robot" ? (this.scene?.robots ?? 0) : this.things[kind].length;
  }

  /** Everything that can be selected. */
  all() {
    return KINDS.flatMap((kind) =>
      Array.from({ length: Math.min(MAX_LISTED, this.count(kind)) }, (_, index) => this.thing(kind, index)),
    );
  }

  /** @param {Kind} kind @param {number} index @returns {Thing} */
  thing(kind, index) {
    const own = kind === "robot" ? this.known.names[index] : this.things[kind][index]?.name;
    return { kind, index, key: `${kind}:${index}`, name: own || `${TITLES[kind]} ${index + 1}` };
  }

  /**
   * The thing of a key such as "robot:0"; null if there is none.
   * @param {string} key
   */
  find(key) {
    const kind = KINDS.find((each) => key.startsWith(`${each}:`)),
      index = Number(key.split(":")[1]);
    return kind && index < this.count(kind) ? this.thing(kind, index) : null;
  }

  /**
   * Where a thing is and how it is turned.
   * @param {Place} thing
   * @returns {[x: number, y: number, angle: number]}
   */
  pose(thing) {
    if (thing.kind === "robot") {
      const [x, y, heading] = this.frame?.poses.subarray(3 * thing.index) ?? [0, 0, 0];
      return [x, y, heading];
    }
    const what = this.things[thing.kind][thing.index];
    if (!what) return [0, 0, 0]; // it was just removed
    if ("x1" in what)
      return [(what.x1 + what.x2) / 2, (what.y1 + what.y2) / 2, Math.atan2(what.y2 - what.y1, what.x2 - what.x1)];
    return [what.x, what.y, "angle" in what ? what.angle : 0];
  }

  /**
   * The radius of the circle around a thing, m.
   * @param {Place} thing
   */
  reach(thing) {
    if (thing.kind === "robot") return this.known.radius;
    const what = this.things[thing.kind][thing.index];
    if (!what) return 0;
    if ("x1" in what) return Math.hypot(what.x2 - what.x1, what.y2 - what.y1) / 2;
    if ("radius" in what) return what.radius;
    return "depth" in what ? Math.hypot(what.width, what.depth) / 2 : 0;
  }

  /**
   * The thing at a place, robots first; null if there is none.
   * @param {number} x
   * @param {number} y
   * @param {number} least the radius of a finger, m
   */
  at(x, y, least) {
    for (const kind of UNDER_POINTER) {
      /** @type {number | null} */
      let best = null;
      let nearest = Infinity;
      for (let index = 0; index < this.count(kind); index++) {
        const thing = { kind, index };
        const [left, low, angle] = this.pose(thing);
        const far = Math.hypot(x - left, y - low);
        if (
          far < nearest &&
          far <= Math.max(this.reach(thing), least) &&
          this.isOn(thing, x - left, y - low, angle, least)
        )
          [best, nearest] = [index, far];
      }
      if (best !== null) return this.thing(kind, best);
    }
    return null;
  }

  /**
   * Whether a place, from the middle of a box or a wall, lies on it; what is round is not asked.
   * @param {Place} thing @param {number} right @param {number} up @param {number} angle @param {number} least
   */
  isOn(thing, right, up, angle, least) {
    const { kind, index } = thing;
    if (kind !== "box" && kind !== "wall") return true;
    const along = Math.abs(right * Math.cos(angle) + up * Math.sin(angle)),
      across = Math.abs(up * Math.cos(angle) - right * Math.sin(angle));
    if (kind === "wall") return along <= this.reach(thing) + least && across <= least;
    return along <= this.things.box[index].width / 2 && across <= this.things.box[index].depth / 2;
  }

  /**
   * The message that puts a thing elsewhere.
   * @param {Place} thing
   * @param {number} x
   * @param {number} y
   * @param {number} [angle] without it the thing stays turned as it is
   * @returns {Request}
   */
  move(thing, x, y, angle) {
    const { kind, index } = thing;
    if (kind === "robot") return { do: "move_robot", robot: index, x, y, heading: angle };
    if (kind === "box") return { do: "move_box", box: index, x, y, angle };
    if (kind === "cylinder") return { do: "move_cylinder", cylinder: index, x, y };
    if (kind === "light") return { do: "set_light", light: index, x, y };
    if (kind === "sound") return { do: "set_sound", sound: index, x, y };
    const half = this.reach(thing),
      turned = angle ?? this.pose(thing)[2];
    const [dx, dy] = [half * Math.cos(turned), half * Math.sin(turned)];
    return { do: "move_wall", wall: index, x1: x - dx, y1: y - dy, x2: x + dx, y2: y + dy };
  }
}
