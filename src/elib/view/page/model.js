// What the page knows of the world: the scene as it was sent, its changes, and the frames.

import { CUT } from "./robot.js";

const TRAIL_LENGTH = 500; // points, at least 4 mm apart: the last two metres or more
const TRAIL_STEP = 0.004; // m
const MOST_TRAILS = 200; // robots that leave one
const SMOOTH = 0.1; // s of the robot's time over which speeds are smoothed

const LISTS = { robot: null, cylinder: "cylinders", box: "boxes", light: "lights", sound: "sounds" };
const TITLES = { robot: "Robots", cylinder: "Posts and balls", box: "Boxes", light: "Lights", sound: "Sounds" };

/** An angle in whole degrees, 0 to 359. */
export function degrees(angle) {
  const whole = Math.round((angle * 180) / Math.PI) % 360;
  return whole < 0 ? whole + 360 : whole + 0; // no minus before nothing
}

export class Model {
  constructor() {
    this.scene = null;
    this.frame = null;
    this.readings = null;
    this.trails = [];
    this.clock = []; // [seconds here, simulated seconds] of the last two seconds
    this.speeds = new Float32Array(0); // m/s and rad/s of each robot
  }

  setScene(scene) {
    this.scene = scene;
    this.frame = this.readings = null;
    this.trails = Array.from({ length: Math.min(scene.robots, MOST_TRAILS) }, () => []);
    this.clock = [];
    this.speeds = new Float32Array(2 * scene.robots);
  }

  change(message) {
    for (const [k, x, y, angle] of message.boxes ?? []) Object.assign(this.scene.boxes[k], { x, y, angle });
    for (const [k, x, y] of message.cylinders ?? []) Object.assign(this.scene.cylinders[k], { x, y });
    for (const [k, light] of message.lights ?? []) this.scene.lights[k] = light;
    for (const [k, sound] of message.sounds ?? []) this.scene.sounds[k] = sound;
    if (message.ambient !== undefined) this.scene.ambient = message.ambient;
  }

  setFrame(frame, seconds) {
    const old = this.frame;
    this.frame = frame;
    if (old && frame.time > old.time) this.measure(old, frame);
    this.trails.forEach((trail, k) => this.follow(trail, frame.poses[3 * k], frame.poses[3 * k + 1]));
    this.clock.push([seconds, frame.time]);
    while (this.clock.length > 2 && seconds - this.clock[0][0] > 2) this.clock.shift();
  }

  /** How fast each robot moves, from two frames, smoothed: however far they are apart, one that stands shows so soon. */
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

  /** Everything that can be selected, in groups: [title, [{ kind, index, key, name }]]. */
  groups() {
    return Object.entries(LISTS).map(([kind, list]) => {
      const count = list ? this.scene[list].length : this.scene.robots;
      return [TITLES[kind], Array.from({ length: count }, (_, index) => this.thing(kind, index))];
    });
  }

  thing(kind, index) {
    const own = LISTS[kind] && this.scene[LISTS[kind]][index].name;
    const title = kind === "cylinder" ? "post" : kind;
    const name = kind === "robot" ? `epuck-${index + 1}` : own || `${title} ${index}`;
    return { kind, index, key: `${kind}:${index}`, name };
  }

  /** The thing of a key such as "robot:0"; null if there is none. */
  find(key) {
    const [kind, index] = key.split(":");
    return kind in LISTS && index !== undefined ? this.thing(kind, Number(index)) : null;
  }

  /** What a thing is: its numbers as they were sent. */
  of(thing) {
    return LISTS[thing.kind] ? this.scene[LISTS[thing.kind]][thing.index] : null;
  }

  /** Where a thing is and how it is turned: [x, y, angle]. */
  pose(thing) {
    if (thing.kind === "robot")
      return this.frame ? [...this.frame.poses.subarray(3 * thing.index, 3 * thing.index + 3)] : [0, 0, 0];
    const what = this.of(thing);
    return [what.x, what.y, what.angle ?? 0];
  }

  isCut(robot) {
    return this.frame !== null && (this.frame.bits[robot] & CUT) !== 0;
  }

  /** The radius within which a click means a thing, m. */
  reach(thing) {
    if (thing.kind === "robot") return this.scene.radius;
    if (thing.kind === "cylinder") return this.of(thing).radius;
    if (thing.kind === "box") return Math.hypot(this.of(thing).width, this.of(thing).depth) / 2;
    return 0;
  }

  /** The thing at a place, robots first; `least` m is the radius of a finger. Null if there is none. */
  at(x, y, least) {
    for (const kind of ["robot", "light", "sound", "cylinder", "box"]) {
      const count = LISTS[kind] ? this.scene[LISTS[kind]].length : (this.frame?.count ?? 0);
      let best = null,
        nearest = Infinity;
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

  isIn(box, x, y, angle) {
    const what = this.of(box),
      right = x - what.x,
      up = y - what.y;
    const along = right * Math.cos(angle) + up * Math.sin(angle),
      across = up * Math.cos(angle) - right * Math.sin(angle);
    return Math.abs(along) <= what.width / 2 && Math.abs(across) <= what.depth / 2;
  }

  /** The message that puts a thing elsewhere. */
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
