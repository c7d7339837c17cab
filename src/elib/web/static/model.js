// What the page knows of the world: the scene as it was sent, its changes, and the frames.

import { CUT } from "./robotshape.js";

const TRAIL_LENGTH = 500; // points, at least 4 mm apart: the last two metres or more
const TRAIL_STEP = 0.004; // m
const MOST_TRAILS = 200; // robots that leave one
const SMOOTH = 0.1; // s of the robot's time over which speeds are smoothed

/** @import { Change, Frame, Readings, Request, Scene } from "./frames.js" */
/** @import { Point } from "./robotshape.js" */

/**
 * What can be selected and moved.
 * @typedef {"robot" | "cylinder" | "box" | "light" | "sound"} Kind
 * @typedef {{ kind: Kind, index: number }} Place where it is in the scene
 * @typedef {Place & { key: string, name: string }} Thing
 */

/**
 * A thing that the pointer holds.
 * @typedef {object} Drag
 * @property {Thing} thing
 * @property {number} angle that it had
 * @property {number} dx from the pointer to its middle, m
 * @property {number} dy
 * @property {number} fromX where the pointer took it, pixels
 * @property {number} fromY
 * @property {boolean} isOn the pointer has moved
 */

/** @type {Record<Kind, "cylinders" | "boxes" | "lights" | "sounds" | null>} */
const LISTS = { robot: null, cylinder: "cylinders", box: "boxes", light: "lights", sound: "sounds" };
const TITLES = { robot: "Robots", cylinder: "Posts and balls", box: "Boxes", light: "Lights", sound: "Sounds" };

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
    /** @type {Point[][]} */
    this.trails = [];
    /** @type {[here: number, simulated: number][]} */
    this.clock = []; // [seconds here, simulated seconds] of the last two seconds
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
    this.trails = Array.from({ length: Math.min(scene.robots, MOST_TRAILS) }, () => []);
    this.clock = [];
    this.speeds = new Float32Array(2 * scene.robots);
  }

  /** @param {Change} message */
  change(message) {
    const scene = this.known;
    for (const [k, x, y, angle] of message.boxes ?? []) Object.assign(scene.boxes[k], { x, y, angle });
    for (const [k, x, y] of message.cylinders ?? []) Object.assign(scene.cylinders[k], { x, y });
    for (const [k, light] of message.lights ?? []) scene.lights[k] = light;
    for (const [k, sound] of message.sounds ?? []) scene.sounds[k] = sound;
    if (message.ambient !== undefined) scene.ambient = message.ambient;
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
    return first && last[0] - first[0] > 0.5 ? (last[1] - first[1]) / (last[0] - first[0]) : null;
  }

  /**
   * Everything that can be selected, in groups.
   * @returns {[title: string, things: Thing[]][]}
   */
  groups() {
    const kinds = /** @type {Kind[]} */ (Object.keys(LISTS));
    return kinds.map((kind) => {
      const list = LISTS[kind],
        count = list ? this.known[list].length : this.known.robots;
      return [TITLES[kind], Array.from({ length: count }, (_, index) => this.thing(kind, index))];
    });
  }

  /** @param {Kind} kind @param {number} index @returns {Thing} */
  thing(kind, index) {
    const own = this.of({ kind, index })?.name;
    const title = kind === "cylinder" ? "post" : kind;
    const name = kind === "robot" ? `epuck-${index + 1}` : own || `${title} ${index}`;
    return { kind, index, key: `${kind}:${index}`, name };
  }

  /**
   * The thing of a key such as "robot:0"; null if there is none.
   * @param {string} key
   */
  find(key) {
    const [kind, index] = key.split(":");
    return kind in LISTS && index !== undefined ? this.thing(/** @type {Kind} */ (kind), Number(index)) : null;
  }

  /**
   * What a thing is: its numbers as they were sent; null for a robot.
   * @param {Place} thing
   */
  of(thing) {
    const list = LISTS[thing.kind];
    return list ? this.known[list][thing.index] : null;
  }

  /**
   * Where a thing is and how it is turned.
   * @param {Place} thing
   * @returns {[x: number, y: number, angle: number]}
   */
  pose(thing) {
    const what = this.of(thing);
    if (what) return [what.x, what.y, "angle" in what ? what.angle : 0];
    if (!this.frame) return [0, 0, 0];
    const [x, y, heading] = this.frame.poses.subarray(3 * thing.index);
    return [x, y, heading];
  }

  /** @param {number} robot */
  isCut(robot) {
    return this.frame !== null && (this.frame.bits[robot] & CUT) !== 0;
  }

  /**
   * The radius within which a click means a thing, m.
   * @param {Place} thing
   */
  reach(thing) {
    const what = this.of(thing);
    if (!what) return this.known.radius;
    if ("radius" in what) return what.radius;
    if ("depth" in what) return Math.hypot(what.width, what.depth) / 2;
    return 0;
  }

  /**
   * The thing at a place, robots first; null if there is none.
   * @param {number} x
   * @param {number} y
   * @param {number} least the radius of a finger, m
   */
  at(x, y, least) {
    for (const kind of /** @type {Kind[]} */ (["robot", "light", "sound", "cylinder", "box"])) {
      const list = LISTS[kind],
        count = list ? this.known[list].length : (this.frame?.count ?? 0);
      /** @type {number | null} */
      let best = null;
      let nearest = Infinity;
      for (let index = 0; index < count; index++) {
        const thing = { kind, index };
        const [left, low, angle] = this.pose(thing);
        const far = Math.hypot(x - left, y - low);
        if (
          far < nearest &&
          far <= Math.max(this.reach(thing), least) &&
          (kind !== "box" || this.isIn(thing, x, y, angle))
        ) {
          [best, nearest] = [index, far];
        }
      }
      if (best !== null) return this.thing(kind, best);
    }
    return null;
  }

  /** @param {Place} box @param {number} x @param {number} y @param {number} angle */
  isIn(box, x, y, angle) {
    const what = this.known.boxes[box.index],
      right = x - what.x,
      up = y - what.y;
    const along = right * Math.cos(angle) + up * Math.sin(angle),
      across = up * Math.cos(angle) - right * Math.sin(angle);
    return Math.abs(along) <= what.width / 2 && Math.abs(across) <= what.depth / 2;
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
    switch (thing.kind) {
      case "robot":
        return { do: "move_robot", robot: thing.index, x, y, heading: angle };
      case "box":
        return { do: "move_box", box: thing.index, x, y, angle };
      case "cylinder":
        return { do: "move_cylinder", cylinder: thing.index, x, y };
      case "light":
        return { do: "set_light", light: thing.index, x, y };
      default:
        return { do: "set_sound", sound: thing.index, x, y };
    }
  }
}
