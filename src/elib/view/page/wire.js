// The WebSocket: what arrives is taken apart here, and requests find their answers.

const HEADER = 24;
const RAYS = 1;

/** Take a frame apart: one number after the other, in the order of the robots (elib/view/wire.py). */
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
  /** @param handlers functions `scene`, `change`, `readings`, `frame` and `state` that take what arrives */
  constructor(handlers) {
    this.handlers = handlers;
    this.waiting = new Map();
    this.next = 1;
    this.patience = 500;
    this.connect();
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
    this.socket = socket;
  }

  lose() {
    for (const settle of this.waiting.values()) settle({ ok: false, error: "the simulation is gone", hint: "" });
    this.waiting.clear();
    this.handlers.state("lost");
    setTimeout(() => this.connect(), this.patience);
    this.patience = Math.min(5000, 2 * this.patience);
  }

  take(data) {
    if (typeof data !== "string") {
      this.handlers.frame(decode(data));
      return;
    }
    const message = JSON.parse(data);
    if (message.kind) {
      this.handlers[message.kind](message);
      return;
    }
    const settle = this.waiting.get(message.id);
    this.waiting.delete(message.id);
    if (settle) settle(message);
  }

  /** Tell the server that a frame is on the screen: it sends no more than two ahead. */
  drawn(number) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(new Uint32Array([number]));
  }

  /** Ask for something; the promise gives the answer, `ok` false where it was refused. */
  ask(message) {
    if (this.socket.readyState !== WebSocket.OPEN) {
      return Promise.resolve({ ok: false, error: "the simulation is gone", hint: "" });
    }
    const id = this.next++;
    this.socket.send(JSON.stringify({ ...message, id }));
    return new Promise((resolve) => this.waiting.set(id, resolve));
  }
}
