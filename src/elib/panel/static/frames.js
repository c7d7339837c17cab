// What the server says of a virtual world, as elib/panel/server/world.py writes it; in m and rad.

const HEADER = 24;
const RAYS = 1;

/**
 * @typedef {{ x1: number, y1: number, x2: number, y2: number, colour: string, name?: string }} Wall
 * @typedef {{ name: string, x: number, y: number, colour: string, pushable: boolean }} Obstacle
 * @typedef {Obstacle & { angle: number, width: number, depth: number }} Box
 * @typedef {Obstacle & { radius: number }} Cylinder
 * @typedef {{ name: string, x: number, y: number, intensity: number }} Light
 * @typedef {{ name: string, x: number, y: number, volume: number }} Sound
 * @typedef {{ latency: number, jitter: number, loss: number }} LinkFaults seconds, seconds and a share
 * @typedef {{ paused: boolean, speed: number, fixed: string }} Clock fixed: why its speed cannot be changed
 * @typedef {[x1: number, y1: number, x2: number, y2: number, colour: string][]} Walls as they are sent
 */

/**
 * What the page has to know once.
 * @typedef {object} Scene
 * @property {string} world
 * @property {number} width
 * @property {number} depth
 * @property {Walls} walls
 * @property {{ colour: string | null, picture: boolean, width: number, depth: number }} floor null: the page's colour
 * @property {string | null} floor_png the painted floor
 * @property {number} robots how many
 * @property {string[]} names of the robots
 * @property {number | null} own the robot of this page
 * @property {number} radius of a robot
 * @property {Box[]} boxes
 * @property {Cylinder[]} cylinders
 * @property {Light[]} lights
 * @property {Sound[]} sounds
 * @property {number} ambient counts
 * @property {Clock} clock
 */

/**
 * What stands elsewhere or shines otherwise than before, each by its index; or all of a kind.
 * @typedef {object} Change
 * @property {[index: number, x: number, y: number, angle: number][]} [boxes]
 * @property {[index: number, x: number, y: number][]} [cylinders]
 * @property {[index: number, light: Light][]} [lights]
 * @property {[index: number, sound: Sound][]} [sounds]
 * @property {Box[]} [all_boxes]
 * @property {Walls} [walls]
 * @property {number} [ambient]
 * @property {Clock} [clock]
 */

/**
 * What one robot perceives and how it is connected; the last three only of a robot that a program has opened.
 * @typedef {object} Readings
 * @property {number} robot its index
 * @property {number[]} proximity counts
 * @property {number[]} encoders steps
 * @property {LinkFaults & { connected: boolean, cut: boolean, script: string[] }} link
 * @property {LinkFaults} [base] of its URL
 * @property {number} [selector]
 * @property {boolean | null} [button] whether it is held down; null where the robot has none
 */

/** @typedef {{ do: string, [key: string]: unknown }} Request a message of the control server */
/** @typedef {ReturnType<typeof decode>} Frame */

/**
 * Take a frame apart: one number after the other, in the order of the robots.
 * @param {ArrayBuffer} buffer
 */
export function decode(buffer) {
  const head = new DataView(buffer);
  const count = head.getUint32(16, true);
  const hasRays = (head.getUint32(4, true) & RAYS) !== 0;
  const raysAt = HEADER + 12 * count;
  const bitsAt = raysAt + (hasRays ? 160 * count : 0);
  return {
    number: head.getUint32(0, true),
    time: head.getFloat64(8, true),
    count,
    poses: new Float32Array(buffer, HEADER, 3 * count),
    rays: hasRays ? new Float32Array(buffer, raysAt, 40 * count) : null,
    bits: new Uint8Array(buffer, bitsAt, count),
    ring: new Uint8Array(buffer, bitsAt + count, 24 * count),
  };
}
