// What the page knows of the robots and their worlds, as signals, and its end of the connection: requests with their
// answers, and what the server tells by itself.
import { effect, signal } from "@preact/signals";
import type * as page from "./messages";
import type { Answer, Failure, Hello, Line, Listed, Play, Scheme, StudyNews, Summary, Tick, Update } from "./messages";
import type * as studio from "./studio/messages";
import { RobotMap } from "./robot/map";
import { World } from "./world/scene";

const SILENCE = 1500; // ms without an update after which what is shown is old
const TOAST_TIME = 8000; // ms
const KEPT_LINES = 500;
const KEPT_POINTS = 5000;
const KEPT_MOMENTS = 3000; // five minutes at ten a second

/** A moment of a robot, for charts: s, and rev/s of the wheels as commanded. */
export type Moment = {
  time: number;
  values: Record<string, (number | null)[]>;
  latency: number | null;
  wheels: [number, number];
};
/** What became of a request; null if the program did not answer. */
export type Reply = Answer | Failure | null;
/** What may be asked and told, on the pages of the panel and in the studio. */
type Asked = page.Asked & studio.Asked;
type Answered = page.Answered & studio.Answered;
type Result<Name> = Name extends keyof Answered ? Answered[Name] : null;
type Told = page.Told | studio.Told | Answer | Failure;
type OfRobot<Name extends keyof Asked> = Omit<Asked[Name], "robot">;

export const hello = signal<Hello | null>(null);
export const listed = signal<Listed[]>([]);
export const overview = signal<Record<string, Summary>>({});
export const worldsOfRobots = signal<[robot: string, name: string][]>([]);
export const study = signal<StudyNews | null>(null);
export const isSilent = signal(false);
export const refusal = signal(""); // why the program does not let the page in, in its words; empty if it said nothing
export const toasts = signal<{ id: number; text: string; isGood: boolean }[]>([]);

/** One robot of the panel. */
export class Robot {
  readonly tick = signal<Tick | null>(null);
  readonly scheme = signal<Scheme | null>(null);
  readonly play = signal<Play | null>(null);
  readonly lines = signal<Line[]>([]);
  readonly pixels = signal<string | null>(null);
  trail: [x: number, y: number][] = [];
  map: RobotMap | null = null;
  history: Moment[] = [];

  constructor(readonly key: string) {}

  take({ tick, scheme, behaviour }: NonNullable<Update["robot"]>) {
    if (scheme) this.scheme.value = scheme;
    const { trail, map, lines, picture } = tick;
    if (trail.whole) this.trail = [];
    if (trail.points.length) this.trail = this.trail.concat(trail.points).slice(-KEPT_POINTS);
    if (trail.whole && !trail.points.length) this.map = null;
    if (map) {
      if (!this.map?.has(map)) this.map = new RobotMap(map);
      this.map.take(map);
    }
    if (lines.whole || lines.lines.length)
      this.lines.value = (lines.whole ? [] : this.lines.value).concat(lines.lines).slice(-KEPT_LINES);
    if (!picture) this.pixels.value = null;
    else if (picture.pixels) this.pixels.value = picture.pixels;
    // A place that is shown again is told all lines again.
    const old = this.play.value,
      before = behaviour.count - behaviour.lines.length,
      known =
        old?.name === behaviour.name ? old.lines.slice(0, Math.max(0, before - old.count + old.lines.length)) : [];
    this.play.value = { ...behaviour, lines: known.concat(behaviour.lines).slice(-KEPT_LINES) };
    // Charts show only news: an old value is not a value of now.
    const values: Moment["values"] = {};
    for (const [name, reading] of Object.entries(tick.readings)) {
      const found = reading?.physical ?? reading?.values;
      if (found && !reading?.stale) values[name] = found.map((each) => (each === null ? null : Number(each)));
    }
    const { left, right } = tick.drive;
    this.history.push({
      time: tick.time,
      values,
      latency: tick.link?.median ?? null,
      wheels: [left ?? 0, right ?? 0],
    });
    if (this.history.length > KEPT_MOMENTS + 500) this.history.splice(0, 500);
    this.tick.value = tick;
  }

  /** Ask something of this robot; a failure is shown, and gives undefined. */
  ask<Name extends keyof Asked>(name: Name, values: OfRobot<Name>) {
    return ask(name, { robot: this.key, ...values } as unknown as Asked[Name]);
  }

  tell<Name extends keyof Asked>(name: Name, values: OfRobot<Name>) {
    tell(name, { robot: this.key, ...values } as unknown as Asked[Name]);
  }
}

export const robots = new Map<string, Robot>();
const worlds = new Map<number, World>();

export function robotOf(key: string) {
  const robot = robots.get(key) ?? new Robot(key);
  robots.set(key, robot);
  return robot;
}

/** Take the robots that there are; of others nothing is kept. */
function list(all: Listed[]) {
  listed.value = all;
  for (const key of robots.keys()) if (!all.some((each) => each.key === key)) robots.delete(key);
}

/** The world that is told on a channel: 0 is the one that the place shows. */
export function worldOf(channel = 0) {
  const world = worlds.get(channel) ?? new World();
  worlds.set(channel, world);
  return world;
}

export const can = () => hello.value?.can ?? NOTHING;
const NOTHING = { drive: false, edit: false, speed: false, save: false, connect: false, files: false, program: false };

// -- the connection --

let send: ((text: string) => void) | null = null; // while somebody hears
let number = 0;
let heard = Infinity; // before the first message the page is only opening
const waiting = new Map<number, (answer: Reply) => void>();

let late = 0; // looks in a row that found nothing new: one alone says only that the page was busy itself
setInterval(() => {
  late = performance.now() - heard > SILENCE ? late + 1 : 0;
  isSilent.value = late > 1;
}, 250);
effect(() => {
  document.documentElement.dataset.silent = isSilent.value ? "yes" : "no";
});

/** Be connected by what sends a text, or by nothing any more: then no request gets an answer. */
export function connect(by: typeof send) {
  send = by;
  if (by) return;
  for (const answer of waiting.values()) answer(null);
  waiting.clear();
  heard = Math.min(heard, performance.now() - SILENCE - 1);
}

/** Hear a message of whatever connects: a text, or the bytes of a frame. */
export const hear = (message: string | ArrayBuffer) =>
  typeof message === "string" ? take(JSON.parse(message)) : takeFrame(message);

/** Takes what only the studio is told. */
export const onTold = { take: (_: studio.Told) => {} };

function take(message: Told) {
  switch (message.type) {
    case "hello":
      hello.value = message;
      for (const each of subscriptions.values()) tell("subscribe", each);
      break;
    case "update":
      heard = performance.now();
      if (message.robots) list(message.robots);
      if (message.robot) robotOf(message.place).take(message.robot);
      if (message.overview) overview.value = message.overview;
      if (message.worlds) worldsOfRobots.value = message.worlds;
      if (message.study) study.value = message.study;
      tell("drawn", { number: message.number });
      break;
    case "answer":
      waiting.get(message.id)?.(message);
      waiting.delete(message.id);
      break;
    case "scene":
    case "change":
    case "readings":
      worldOf(message.channel).take(message);
      break;
    case "output":
    case "program":
      onTold.take(message);
  }
}

const drawn = new Map<number, number>(); // the newest frame of each channel, until the server was told

function takeFrame(frame: ArrayBuffer) {
  const head = new DataView(frame),
    channel = head.getUint32(20, true);
  worldOf(channel).takeFrame(frame);
  if (!drawn.size) requestAnimationFrame(tellDrawn); // a page that nobody sees gets no more
  drawn.set(channel, head.getUint32(0, true));
}

function tellDrawn() {
  tell("frames_drawn", { frames: [...drawn] });
  drawn.clear();
}

/** Say something that needs no answer. */
export function tell<Name extends keyof Asked>(name: Name, values: Asked[Name], id = 0) {
  send?.(JSON.stringify({ do: name, id, ...values }));
}

/** Ask for something, and return what became of it. */
export function request<Name extends keyof Asked>(name: Name, values: Asked[Name]) {
  const id = ++number;
  return new Promise<Reply>((resolve) => {
    if (!send) return resolve(null);
    waiting.set(id, resolve);
    tell(name, values, id);
  });
}

export const reason = (reply: Exclude<Reply, Answer>) =>
  reply
    ? [reply.error.message, reply.error.hint && `(${reply.error.hint})`].join(" ").trim()
    : "The program does not answer.";

/** Ask for something; a failure is shown, and gives undefined. What has no result gives null. */
export async function ask<Name extends keyof Asked>(name: Name, values: Asked[Name]) {
  const reply = await request(name, values);
  if (reply?.ok) return reply.result as Result<Name>;
  toast(reason(reply));
  return undefined;
}

export function toast(text: string, isGood = false) {
  const id = ++number;
  toasts.value = [...toasts.value, { id, text, isGood }];
  setTimeout(() => closeToast(id), TOAST_TIME);
}

export const closeToast = (id: number) => (toasts.value = toasts.value.filter((each) => each.id !== id));

// -- what the page wants to be told --

type Subscription = Asked["subscribe"];
const subscriptions = new Map<string, Subscription>();

/** Be told of something until the function that is returned is called. */
export function subscribe(wanted: Subscription) {
  const name = `${wanted.what} ${wanted.channel ?? 0}`;
  subscriptions.set(name, wanted);
  tell("subscribe", wanted);
  return () => {
    if (subscriptions.get(name) !== wanted) return;
    subscriptions.delete(name);
    // Whoever asks for the same in another way does so at once, and is not told anew of what it knows.
    queueMicrotask(() => subscriptions.has(name) || tell("subscribe", { ...wanted, rate: 0 }));
  };
}
