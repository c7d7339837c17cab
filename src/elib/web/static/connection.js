// The page's end of the WebSocket: requests with their answers, and what the server sends by itself.

const AGAIN = 1000; // ms until a connection that broke is opened again

/**
 * What became of a request: `result` if it is ok, otherwise why it is not.
 * @typedef {{ ok: boolean, result?: any, error?: string, hint?: string }} Answer
 */

/**
 * @typedef {object} Ears what the connection calls
 * @property {(message: any) => void} onMessage a message of the server
 * @property {(frame: ArrayBuffer) => void} onFrame a frame of the world
 * @property {(isOpen: boolean) => void} onState
 */

export class Connection {
  /** @param {Ears} ears */
  constructor(ears) {
    this.ears = ears;
    /** @type {Map<number, (answer: Answer) => void>} */
    this.waiting = new Map();
    this.number = 0;
    /** @type {WebSocket | null} */
    this.socket = null;
    this.open();
  }

  open() {
    const socket = new WebSocket(`ws://${location.host}/ws`);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.addEventListener("open", () => this.ears.onState(true));
    socket.addEventListener("close", () => {
      for (const answer of this.waiting.values()) answer({ ok: false, error: "The program does not answer." });
      this.waiting.clear();
      this.ears.onState(false);
      setTimeout(() => this.open(), AGAIN);
    });
    socket.addEventListener("message", (event) => {
      if (typeof event.data !== "string") this.ears.onFrame(event.data);
      else this.take(JSON.parse(event.data));
    });
  }

  /** @param {any} message */
  take(message) {
    if (message.type !== "answer") {
      this.ears.onMessage(message);
      return;
    }
    this.waiting.get(message.id)?.(message);
    this.waiting.delete(message.id);
  }

  /**
   * Say something that needs no answer.
   * @param {string} what
   * @param {object} values
   */
  tell(what, values = {}) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ do: what, ...values }));
  }

  /**
   * Ask for something; what comes back is never an exception.
   * @param {string} what
   * @param {object} values
   * @returns {Promise<Answer>}
   */
  ask(what, values = {}) {
    if (this.socket?.readyState !== WebSocket.OPEN)
      return Promise.resolve({ ok: false, error: "The program does not answer." });
    const id = ++this.number;
    return new Promise((resolve) => {
      this.waiting.set(id, resolve);
      this.tell(what, { id, ...values });
    });
  }
}
