// What a page asks of a virtual world, and what the world says to that.
import { signal } from "@preact/signals";
import { ask } from "../store";
import type { Order, World } from "./scene";

type Reply = { ok: boolean; error: string; hint?: string; result?: unknown };

const PACE = 40; // ms between two orders of a kind
const SHOWN = 6000; // ms that an answer is shown
const BOX = 0.1,
  WALL = 0.3; // m
const TRIALS = 40; // places where a new thing may have room

export class Orders {
  readonly said = signal("");
  private waiting = new Map<string, Order | null>();
  private timer = 0;

  constructor(private readonly world: World) {}

  /** Ask for a change; null if one of its kind is under way. Of several only the newest waits: a drag makes many. */
  async act(order: Order) {
    const kind = `${order.do} ${Object.keys(order)}`,
      isFirst = !this.waiting.has(kind);
    this.waiting.set(kind, order);
    if (!isFirst) return null;
    let reply: Reply | null = null;
    for (let next; (next = this.waiting.get(kind));) {
      this.waiting.set(kind, null);
      [reply] = await Promise.all([this.send(next), new Promise((resolve) => setTimeout(resolve, PACE))]);
    }
    this.waiting.delete(kind);
    return reply;
  }

  async send(message: Order, isTrial = false): Promise<Reply> {
    const reply = ((await ask("world", { message })) ?? { ok: false, error: "" }) as Reply;
    if (!isTrial) this.say(reply.ok ? "" : `${reply.error}${reply.hint ? ` (${reply.hint})` : ""}`);
    return reply;
  }

  private say(text: string) {
    this.said.value = text;
    clearTimeout(this.timer);
    if (text) this.timer = setTimeout(() => (this.said.value = ""), SHOWN);
  }

  /** Put a box or a wall where there is room, as near to a place as can be. */
  async add(kind: "box" | "wall", [middleX, middleY]: [number, number]) {
    const half = kind === "box" ? BOX / 2 : WALL / 2;
    let reply: Reply = { ok: false, error: "" };
    for (let turn = 0; turn < TRIALS; turn++) {
      const far = half * Math.sqrt(turn), // a spiral
        [x, y] = [middleX + far * Math.cos(2.4 * turn), middleY + far * Math.sin(2.4 * turn)],
        place = kind === "box" ? { x, y } : { x1: x - half, y1: y, x2: x + half, y2: y };
      reply = await this.send({ do: `add_${kind}`, ...place }, true);
      if (reply.ok || !reply.error.includes("no room")) break;
    }
    if (reply.ok) this.world.selectAdded(`${kind}:${reply.result}`);
    else this.say(reply.error);
  }

  remove() {
    const thing = this.world.selected.value;
    if (thing?.kind !== "box" && thing?.kind !== "wall") return;
    this.world.select(null);
    return this.send({ do: `remove_${thing.kind}`, [thing.kind]: thing.index });
  }
}
