// The WebSocket: what arrives is taken apart here, and requests find their answers.

const HEADER = 24;
const RAYS = 1;

// What the server says and is asked, as elib/view/wire.py and the control server have it; in m and rad.

/**
 * @typedef {{ name: string, x: number, y: number, colour: string, pushable: boolean }} Obstacle
 * @typedef {Obstacle & { angle: number, width: number, depth: number }} Box
 * @typedef {Obstacle & { radius: number }} Cylinder
 * @typedef {{ name: string, x: number, y: number, intensity: number }} Light
 * @typedef {{ name: string, x: number, y: number, volume: number }} Sound
 * @typedef {{ latency: number, jitter: number, loss: number }} LinkFaults seconds, seconds and a share
 */

/**
 * What the page has to know once.
 * @typedef {object} Scene
 * @property {string} world
 * @property {number} width
 * @property {number} depth
 * @property {[x1: number, y1: number, x2: number, y2: number, colour: string][]} walls
 * @property {{ colour: string | null, picture: boolean, width: number, depth: number }} floor null: the page's colour
 * @property {number} robots how many
 * @property {number} radius of a robot
 * @property {number[]} leds angles of a robot's ring
 * @property {Box[]} boxes
 * @property {Cylinder[]} cylinders
 * @property {Light[]} lights
 * @property {Sound[]} sounds
 * @property {number} ambient counts
 * @property {LinkFaults} link of every robot
 */

/**
 * What stands elsewhere or shines otherwise than before, each by its index.
 * @typedef {object} Change
 * @property {[index: number, x: number, y: number, angle: number][]} [boxes]
 * @property {[index: number, x: number, y: number][]} [cylinders]
 * @property {[index: number, light: Light][]} [lights]
 * @property {[index: number, sound: Sound][]} [sounds]
 * @property {number} [ambient]
 */

/**
 * What one robot perceives and how it is connected.
 * @typedef {object} Readings
 * @property {number} robot its index
 * @property {number[]} proximity counts
 * @property {number[]} encoders steps
 * @property {LinkFaults & { connected: boolean, cut: boolean }} link
 */

/**
 * A request; `do` says what for, and the other keys depend on it.
 * @typedef {{ do: string, [key: string]: unknown }} Request
 * @typedef {{ ok: true } | { ok: false, error: string, hint: string }} Reply
 */

/**
 * What the page does with what arrives.
 * @typedef {object} Handlers
 * @property {(scene: Scene) => void} scene
 * @property {(change: Change) => void} change
 * @property {(readings: Readings) => void} readings
 * @property {(frame: Frame) => void} frame
 * @property {(what: "live" | "lost") => void} state
 */

/** @typedef {ReturnType<typeof decode>} Frame */

/**
 * Take a frame apart: one number after the other, in the order of the robots (elib/view/wire.py).
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

export class Wire {
  /** @param {Handlers} handlers */
  constructor(handlers) {
    this.handlers = handlers;
    /** @type {Map<number, (reply: Reply) => void>} */
    this.waiting = new Map();
    this.next = 1;
    this.patience = 500;
    this.socket = this.connect();
  }

  connect() {
    const socket = new WebSocket(`ws://${location.host}/live`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.patience = 500;
      this.handlers.state("live");
    };
    socket.onmessage = (event) => this.take(event.data);
    socket.onclose = () => this.lose();
    return socket;
  }

  lose() {
    for (const settle of this.waiting.values()) settle({ ok: false, error: "the simulation is gone", hint: "" });
    this.waiting.clear();
    this.handlers.state("lost");
    setTimeout(() => (this.socket = this.connect()), this.patience);
    this.patience = Math.min(5000, 2 * this.patience);
  }

  /** @param {string | ArrayBuffer} data */
  take(data) {
    if (typeof data !== "string") {
      this.handlers.frame(decode(data));
      return;
    }
    const message = JSON.parse(data);
    if (message.kind) {
      this.handlers[/** @type {"scene" | "change" | "readings"} */ (message.kind)](message);
      return;
    }
    const settle = this.waiting.get(message.id);
    this.waiting.delete(message.id);
    if (settle) settle(message);
  }

  /**
   * Tell the server that a frame is on the screen: it sends no more than two ahead.
   * @param {number} number
   */
  drawn(number) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(new Uint32Array([number]));
  }

  /**
   * Ask for something; the promise gives the answer, `ok` false where it was refused.
   * @param {Request} message
   * @returns {Promise<Reply>}
   */
  ask(message) {
    if (this.socket.readyState !== WebSocket.OPEN) {
      return Promise.resolve({ ok: false, error: "the simulation is gone", hint: "" });
    }
    const id = this.next++;
    this.socket.send(JSON.stringify({ ...message, id }));
    return new Promise((resolve) => this.waiting.set(id, resolve));
  }
}
