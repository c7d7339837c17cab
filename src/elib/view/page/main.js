// The live view: ties the wire, the model, the canvas and the panel together.

import { Arena } from "./arena.js";
import { Model } from "./model.js";
import { Panel } from "./panel.js";
import { Wire } from "./wire.js";

/** @import { Drag, Thing } from "./model.js" */
/** @import { Request } from "./wire.js" */

const STEP = 0.01,
  LONG_STEP = 0.05; // m, for the arrow keys
const MOST_CHOICES = 2000; // things in the list
const MANY = 8; // robots whose rays nobody wants to see at first: they would cover each other

/** @type {(id: string) => HTMLElement} */
const $ = (id) => /** @type {HTMLElement} */ (document.getElementById(id));
/** @type {(id: string) => HTMLInputElement} */
const input = (id) => /** @type {HTMLInputElement} */ ($(id));
const canvas = /** @type {HTMLCanvasElement} */ ($("arena")),
  list = /** @type {HTMLSelectElement} */ ($("thing")),
  ambient = input("ambient"),
  model = new Model(),
  arena = new Arena(canvas, model);
const panel = new Panel($("detail"), model, act, turn);
let isDue = false,
  wasAsked = false,
  hushed = 0;
/** @type {Drag & { x: number, y: number } | null} with where the thing is wanted */
let drag = null;
/** @type {Map<string, Request | null>} */
const queued = new Map(); // what waits until the same kind of request was answered

const wire = new Wire({
  scene(scene) {
    model.setScene(scene);
    document.title = `${scene.world}: elib`;
    $("world").textContent = scene.world;
    document.documentElement.style.setProperty("--aspect", `${scene.width} / ${scene.depth}`);
    ambient.value = String(scene.ambient);
    $("ambient-value").textContent = String(Math.round(scene.ambient));
    fillList();
    arena.floor = null;
    arena.fit();
    if (scene.floor.picture) loadFloor();
    select(null);
    if (scene.robots > MANY && !wasAsked) input("show-rays").checked = arena.shows.rays = false;
    wire.ask({ do: "rays", on: arena.shows.rays });
  },
  change(message) {
    model.change(message);
    if (message.ambient !== undefined && !ambient.matches(":active")) ambient.value = String(message.ambient);
    $("ambient-value").textContent = String(Math.round(model.known.ambient));
    redraw();
  },
  readings(message) {
    model.readings = message;
  },
  frame(frame) {
    model.setFrame(frame, performance.now() / 1000);
    redraw();
  },
  state(what) {
    $("state").textContent = what === "live" ? "live" : "not connected; trying again";
    $("state").dataset.is = what;
  },
});

function redraw() {
  if (isDue) return;
  isDue = true;
  requestAnimationFrame(() => {
    isDue = false;
    arena.draw();
    if (!model.frame) return;
    wire.drawn(model.frame.number);
    $("time").textContent = `${model.frame.time.toFixed(1)} s`;
    $("ratio").textContent = model.ratio === null ? "" : `× ${model.ratio.toFixed(2)}`;
    panel.renew();
  });
}

async function loadFloor() {
  const picture = new Image();
  picture.src = "floor.png";
  await picture.decode().catch(() => null);
  arena.floor = picture.naturalWidth ? picture : null;
  arena.fit();
  redraw();
}

function fillList() {
  let left = MOST_CHOICES;
  const groups = model
    .groups()
    .filter(([, things]) => things.length)
    .map(([title, things]) => {
      const group = document.createElement("optgroup");
      group.label = title;
      group.append(...things.slice(0, left).map((thing) => new Option(thing.name, thing.key)));
      left = Math.max(0, left - things.length);
      return group;
    });
  list.replaceChildren(new Option("nothing", ""), ...groups);
}

/** @param {Thing | null} thing */
function select(thing) {
  arena.selected = thing;
  model.readings = null;
  list.value = thing ? thing.key : "";
  wire.ask({ do: "watch", robot: thing && thing.kind === "robot" ? thing.index : null });
  panel.show(thing);
  redraw();
}

/**
 * Say something to those who look and those who listen.
 * @param {string} text
 */
function say(text) {
  $("say").textContent = text;
  $("say").classList.add("on");
  clearTimeout(hushed);
  hushed = setTimeout(() => $("say").classList.remove("on"), 4000);
}

/**
 * Ask for a change. Of several of a kind only the newest waits: a slider makes more than anybody needs.
 * @param {Request} message
 */
async function act(message) {
  const kind = `${message.do} ${Object.keys(message)}`;
  if (queued.has(kind)) {
    queued.set(kind, message);
    return null;
  }
  queued.set(kind, null);
  let reply = await wire.ask(message);
  for (let next = queued.get(kind); next; next = queued.get(kind)) {
    queued.set(kind, null);
    reply = await wire.ask(next);
  }
  queued.delete(kind);
  if (!reply.ok)
    say(reply.hint && reply.hint !== "choose a free place" ? `${reply.error} (${reply.hint})` : reply.error);
  return reply;
}

/** @param {Thing} thing @param {number} x @param {number} y @param {number | undefined} angle */
async function move(thing, x, y, angle) {
  const reply = await act(model.move(thing, x, y, angle));
  if (reply) arena.ghost = reply.ok || !drag?.isOn ? null : { thing, x: drag.x, y: drag.y };
  redraw();
}

/** @param {number} by */
function turn(by) {
  if (!arena.selected) return;
  const [x, y, angle] = model.pose(arena.selected);
  move(arena.selected, x, y, angle + by);
}

// The pointer

/** @param {PointerEvent} event */
function place(event) {
  const box = canvas.getBoundingClientRect();
  return arena.toWorld(event.clientX - box.left, event.clientY - box.top);
}

/** @type {(event: PointerEvent) => number} */
const finger = (event) => (event.pointerType === "touch" ? 20 : 9) / arena.scale;

canvas.addEventListener("pointerdown", (event) => {
  if (!model.frame || event.button !== 0) return;
  const [x, y] = place(event),
    thing = model.at(x, y, finger(event));
  if (thing?.key !== arena.selected?.key) select(thing);
  if (!thing) return;
  const [left, low, angle] = model.pose(thing);
  drag = {
    thing,
    angle,
    dx: left - x,
    dy: low - y,
    fromX: event.clientX,
    fromY: event.clientY,
    x: left,
    y: low,
    isOn: false,
  };
  canvas.setPointerCapture(event.pointerId);
});

canvas.addEventListener("pointermove", (event) => {
  if (!model.frame) return;
  const [x, y] = place(event);
  if (!drag) {
    hover(event, x, y);
    return;
  }
  if (!drag.isOn && Math.hypot(event.clientX - drag.fromX, event.clientY - drag.fromY) < 4) return;
  drag.isOn = true;
  $("tip").hidden = true;
  canvas.style.cursor = "grabbing";
  drag.x = x + drag.dx;
  drag.y = y + drag.dy;
  // A robot that drives turns meanwhile; nobody wants it turned back.
  move(drag.thing, drag.x, drag.y, drag.thing.kind === "robot" ? undefined : drag.angle);
});

function drop() {
  drag = arena.ghost = null;
  canvas.style.cursor = "";
  redraw();
}
canvas.addEventListener("pointerup", drop);
canvas.addEventListener("pointercancel", drop);
canvas.addEventListener("pointerleave", () => {
  $("tip").hidden = true;
});

/** @param {PointerEvent} event @param {number} x @param {number} y */
function hover(event, x, y) {
  const thing = event.pointerType === "touch" ? null : model.at(x, y, finger(event)),
    tip = $("tip");
  canvas.style.cursor = thing ? "grab" : "";
  tip.hidden = !thing;
  if (!thing) return;
  const [left, low, angle] = model.pose(thing),
    lines = [thing.name, `${left.toFixed(2)}, ${low.toFixed(2)} m`];
  if (thing.kind === "robot")
    lines.push(`${((angle * 180) / Math.PI).toFixed(0)}°   ${(100 * model.speeds[2 * thing.index]).toFixed(1)} cm/s`);
  if (thing.kind === "robot" && model.isCut(thing.index)) lines.push("link cut");
  tip.textContent = lines.join("\n");
  const box = canvas.getBoundingClientRect(),
    right = event.clientX - box.left,
    top = event.clientY - box.top;
  tip.style.left = `${Math.min(right + 16, box.width - 150)}px`;
  tip.style.top = `${Math.max(4, Math.min(top + 16, box.height - 90))}px`;
}

// The keyboard

canvas.addEventListener("keydown", (event) => {
  if (!model.frame || event.ctrlKey || event.metaKey || event.altKey) return;
  const step = event.shiftKey ? LONG_STEP : STEP;
  /** @type {Record<string, [dx: number, dy: number]>} */
  const arrows = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
  if (event.key in arrows && arena.selected) {
    const [x, y, angle] = model.pose(arena.selected),
      [dx, dy] = arrows[event.key];
    move(arena.selected, x + dx, y + dy, arena.selected.kind === "robot" ? undefined : angle);
  } else if (event.key === "[") turn(Math.PI / 12);
  else if (event.key === "]") turn(-Math.PI / 12);
  else if (event.key === "n" || event.key === "p") stepThrough(event.key === "n" ? 1 : -1);
  else if (event.key === "Escape") select(null);
  else return;
  event.preventDefault();
});

/** @param {number} by */
function stepThrough(by) {
  const keys = [...list.options].map((option) => option.value);
  const next = (Math.max(0, keys.indexOf(list.value)) + by + keys.length) % keys.length;
  select(model.find(keys[next]));
  say(arena.selected ? `${arena.selected.name} selected` : "nothing selected");
}

// The panel

list.addEventListener("change", () => select(model.find(list.value)));
for (const what of /** @type {(keyof typeof arena.shows)[]} */ (["trails", "rays", "names"])) {
  const box = input(`show-${what}`);
  box.addEventListener("change", () => {
    arena.shows[what] = box.checked;
    wasAsked ||= what === "rays";
    if (what === "rays") wire.ask({ do: "rays", on: box.checked });
    redraw();
  });
}
ambient.addEventListener("input", () => {
  $("ambient-value").textContent = ambient.value;
  act({ do: "set_ambient", ambient: ambient.valueAsNumber });
});

// Light and dark

const dark = matchMedia("(prefers-color-scheme: dark)");
let isDark = dark.matches;
function dress() {
  document.documentElement.dataset.theme = isDark ? "dark" : "light";
  arena.fit();
  redraw();
}
dark.addEventListener("change", () => {
  isDark = dark.matches;
  dress();
});
$("theme").addEventListener("click", () => {
  isDark = !isDark;
  dress();
});
new ResizeObserver(() => {
  arena.fit();
  redraw();
}).observe(canvas);
dress();

// For tests and for the curious: the same objects the page works with.
Object.assign(window, { elib: { arena, model, wire } });
