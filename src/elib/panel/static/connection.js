// The page's end of the WebSocket: requests with their answers, and what the server sends by itself.

const AGAIN = 1000; // ms until a connection that broke is opened again
const SILENT = { ok: false, error: "The program does not answer." };

/**
 * What became of a request: `result` if it is ok, otherwise why it is not.
 * @typedef {{ ok: boolean, result?: any, error?: string, hint?: string }} Answer
 */

export class Connection {
  /**
   * @param {(message: any) => void} onMessage called with each message of the server
   * @param {(frame: ArrayBuffer) => void} onFrame called with each frame of the world
   * @param {() => void} onClose
   */
  constructor(onMessage, onFrame, onClose) {
    this.onMessage = onMessage;
    this.onFrame = onFrame;
    this.onClose = onClose;
    /** @type {Map<number, (answer: Answer) => void>} */
    this.waiting = new Map();
    this.number = 0;
    this.socket = this.open();
  }

  open() {
    const socket = new WebSocket(`ws://${location.host}/ws`);
    socket.binaryType = "arraybuffer";
    socket.addEventListener("close", () => {
      for (const answer of this.waiting.values()) answer(SILENT);
      this.waiting.clear();
      this.onClose();
      setTimeout(() => {
        this.socket = this.open();
      }, AGAIN);
    });
    socket.addEventListener("message", ({ data }) => {
      if (typeof data !== "string") return this.onFrame(data);
      const message = JSON.parse(data);
      if (message.type === "error") return; // of a request without an answer, which nobody waits for
      if (message.type !== "answer") return this.onMessage(message);
      this.waiting.get(message.id)?.({ ...message, error: message.error?.message, hint: message.error?.hint });
      this.waiting.delete(message.id);
    });
    return socket;
  }

  /**
   * Say something that needs no answer.
   * @param {string} what
   * @param {object} values
   */
  tell(what, values = {}) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ do: what, ...values }));
  }

  /**
   * Ask for something; what comes back is never an exception.
   * @param {string} what
   * @param {object} values
   * @returns {Promise<Answer>}
   */
  ask(what, values = {}) {
    if (this.socket.readyState !== WebSocket.OPEN) return Promise.resolve(SILENT);
    const id = ++this.number;
    return new Promise((resolve) => {
      this.waiting.set(id, resolve);
      this.tell(what, { id, ...values });
    });
  }
}
