// The program that runs: how it stands, what it printed, and what Run, Stop and Pause ask of Python.
import { effect, signal } from "@preact/signals";
import { stops } from "../stop";
import { ask, onTold, tell } from "../store";
import type { Asked, Lab, Output, Program } from "./messages";
import { name, save, textNow } from "./programs";
import { loading, restart } from "./wire";

const MOST_LINES = 2000; // of the output
const LONGEST_LINE = 2000; // characters
const MOST_LETTERS = 4_000_000; // that wait for a picture
const BLOCK = 100; // lines
const PATIENCE = 150; // ms that the program has to end after a stop, until its worker is ended

const NOTHING = { name: "", line: null, time: 0, variables: [], stack: [], mistake: null, goals: [] };
const IDLE: Program = { type: "program", state: "idle", ...NOTHING };

export const program = signal(IDLE);
export const isIdle = () => program.value.state === "idle";
export const isWaiting = signal(false); // Run was pressed while Python is loaded
export const speed = signal(1);
export const robot = signal(""); // the URL that takes the place of the program's own
export const lab = signal<Lab | null>(null);
export const breakpoints = signal<number[]>([]);
export const shownLine = signal<{ line: number } | null>(null); // that the editor scrolls to

// -- what it prints --

export type Line = { text: string; isError: boolean };
/** What was printed, in blocks of lines: of a flood only the newest one is drawn again. */
export const blocks = signal<Line[][]>([]);
export const dropped = signal(0); // lines that were printed before those that are kept
let printed: Output[] = []; // since the last picture
let size = 0; // letters of it
let full: Line[][] = [];
let open: Line[] = [];

export function clear() {
  [printed, full, open] = [[], [], []];
  size = dropped.value = 0;
  blocks.value = [];
}

/** Take what was printed; it is drawn with the next picture, however often something is printed until then. */
function print(output: Output) {
  if (!printed.length) requestAnimationFrame(draw);
  printed.push(output);
  size += output.text.length;
  if (size > MOST_LETTERS) draw(); // a window that nobody sees has no next picture
}

function draw() {
  for (const { text, is_error: isError } of printed) {
    const [rest, ...lines] = text.split("\n"),
      last = open.at(-1),
      surplus = Math.max(0, lines.length - MOST_LINES);
    if (last && (last.isError === isError || !last.text)) open[open.length - 1] = lineOf(last.text + rest, isError);
    else lines.unshift(rest);
    dropped.value += surplus;
    for (const line of lines.slice(surplus)) {
      if (open.length === BLOCK) full.push(open.splice(0));
      open.push(lineOf(line, isError));
    }
  }
  for (; full.length * BLOCK > MOST_LINES; full.shift()) dropped.value += BLOCK;
  blocks.value = [...full, open.slice()];
  printed = [];
  size = 0;
}

const lineOf = (text: string, isError: boolean) => ({
  text: text.length > LONGEST_LINE ? `${text.slice(0, LONGEST_LINE)} …` : text,
  isError,
});

const say = (text: string) => print({ type: "output", text: `${text}\n`, is_error: true });

// -- what it is asked --

onTold.take = (message) => (message.type === "output" ? print(message) : (program.value = message));

let runs = 0;

/** Run what stands in the editor; it is saved first. Before Python is loaded, it waits for that. */
export async function run() {
  if (program.value.state === "paused") return goOn("on");
  if (program.value.state === "running") return;
  save(true);
  isWaiting.value = loading.value !== null;
  if (isWaiting.value) return;
  runs++;
  clear();
  program.value = { ...IDLE, state: "running" }; // until Python says more: a second Run begins nothing
  const begun = await ask("run_program", {
    text: textNow(),
    name: name.value,
    robot: robot.value,
    speed: speed.value,
    breakpoints: breakpoints.value,
    lab: lab.value?.name ?? "",
  });
  if (begun === undefined) program.value = IDLE;
}

/** End the program, whatever it does: if it does not end by itself, Python is ended and loaded again. */
export async function stop() {
  isWaiting.value = false;
  if (isIdle()) return;
  const run = runs;
  tell("stop_program", {});
  await new Promise((resolve) => setTimeout(resolve, PATIENCE));
  if (isIdle() || run !== runs) return;
  program.value = IDLE;
  restart();
  say("The program was ended: it did not stop by itself. Python is loaded again.");
}

export const pause = () => ask("pause_program", {});
export const goOn = (how: Asked["go_on"]["how"]) => ask("go_on", { how });

stops.subscribe((count) => count && stop()); // Escape, and Space outside of the editor
addEventListener("keydown", press, true);

function press(event: KeyboardEvent) {
  if (event.key !== "Enter" || !(event.ctrlKey || event.metaKey)) return;
  event.preventDefault();
  event.stopPropagation(); // in the editor it would begin a line
  run();
}

effect(() => {
  const lines = breakpoints.value;
  if (program.peek().state !== "idle") tell("set_breakpoints", { lines });
});
effect(() => {
  const now = { speed: speed.value };
  if (program.peek().state !== "idle") tell("set_speed", now);
});
// Before a run, the world stands there with nobody driving.
effect(() => {
  const wanted = { robot: robot.value };
  if (loading.value) return;
  if (isWaiting.peek()) run();
  else if (program.peek().state === "idle") tell("show_world", wanted);
});
