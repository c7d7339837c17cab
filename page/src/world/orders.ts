// What a page asks of a virtual world, and what the world says to that.
import { signal } from "@preact/signals";
import type { Asked } from "../messages";
import { can, reason, request, type Reply } from "../store";
import type { Order, World } from "./scene";

const PACE = 40; // ms between two orders of a kind
const SHOWN = 6000; // ms that an answer is shown
const BOX = 0.1,
  WALL = 0.3; // m
const TRIALS = 40; // places where a new thing may have room

export class Orders {
  readonly said = signal("");
  private waiting = new Map<string, Order | null>();
  private timer = 0;

  constructor(
    private readonly world: World,
    private readonly whenAdded = "",
  ) {}

  get mayEdit() {
    return can().edit && this.world.isLive.value && this.world.past.value === null;
  }

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

  async send({ do: name, ...values }: Order, isTrial = false): Promise<Reply> {
    const reply = await request(name, values as Asked[typeof name]);
    if (!isTrial) this.say(reply?.ok ? "" : reason(reply));
    return reply;
  }

  say(text: string) {
    this.said.value = text;
    clearTimeout(this.timer);
    if (text) this.timer = setTimeout(() => (this.said.value = ""), SHOWN);
  }

  /** Put a box or a wall where there is room, as near to a place as can be. */
  async add(kind: "box" | "wall", [middleX, middleY]: [number, number]) {
    if (!this.mayEdit) return;
    const half = kind === "box" ? BOX / 2 : WALL / 2;
    let reply: Reply = null;
    for (let turn = 0; turn < TRIALS; turn++) {
      const far = half * Math.sqrt(turn), // a spiral
        [x, y] = [middleX + far * Math.cos(2.4 * turn), middleY + far * Math.sin(2.4 * turn)],
        order: Order =
          kind === "box" ? { do: "add_box", x, y } : { do: "add_wall", x1: x - half, y1: y, x2: x + half, y2: y };
      reply = await this.send(order, true);
      if (!reply || reply.ok || !reply.error.message.includes("no room")) break;
    }
    if (reply?.ok) this.world.selectAdded(`${kind}:${reply.result}`);
    this.say(reply?.ok ? this.whenAdded : reason(reply));
  }

  remove() {
    const thing = this.world.selected.value;
    if ((thing?.kind !== "box" && thing?.kind !== "wall") || !this.mayEdit) return;
    const { kind, index } = thing;
    this.world.select(null);
    return this.send(kind === "box" ? { do: "remove_box", box: index } : { do: "remove_wall", wall: index });
  }
}
