// The program that runs: how it stands, what it printed, and what Run, Stop and Pause ask of Python.
import { computed, effect, signal } from "@preact/signals";
import { stops } from "../stop";
import { ask, onTold, tell } from "../store";
import type { Asked, Output, ProgramNews, Report } from "./messages";
import { imported, isOwn, lab, name, opened, revision, save, textNow } from "./programs";
import { halt, hasPort } from "./serial";
import { loading, restart } from "./wire";

export const MOST_LINES = 2000; // of the output
const LONGEST_LINE = 2000; // characters
const MOST_WAITING = 300; // pieces of output that are not drawn: a window that nobody sees draws none
const PATIENCE = 150; // ms that the program has to end after a stop, until its worker is ended

const NAMED = /["'](sim:\/\/[^"'\s]*)["']/; // a robot, in a program
const NOTHING = {
  name: "",
  line: null,
  time: 0,
  variables: [],
  stack: [],
  mistake: null,
  goals: [],
  states: ["", ""] as [string, string],
};
const IDLE: ProgramNews = { type: "program", state: "idle", ...NOTHING };

export const program = signal(IDLE);
const ran = signal({ as: "", of: opened.value }); // what is run or checked: its name, and how it was opened
/** How the program that is open stands; another one may run meanwhile. */
export const here = computed(() => {
  const { as, of } = ran.value;
  return opened.value === of || (isOwn.value && name.value === as) ? program.value : IDLE;
});
export const isIdle = () => program.value.state === "idle";
export const isWaiting = signal(false); // Run was pressed while Python is loaded
export const speed = signal(1);
export const robot = signal(""); // the URL that takes the place of the program's own
/** Whether that is a real robot. A lab has a robot of its own. */
export const isReal = computed(() => hasPort.value && !lab.value);
export const report = signal<Report | null>(null); // of the check that was the last run
export const breakpoints = signal<number[]>([]);
export const shownLine = signal<{ line: number } | null>(null); // that the editor scrolls to

// -- what it prints --

export type Line = { number: number; text: string; isError: boolean };
export const lines = signal<Line[]>([]);
let printed: Output[] = []; // since the last picture
let count = 0; // lines that were printed, and more where some were left out

export function clear() {
  [printed, lines.value, count, report.value] = [[], [], 0, null];
  ran.value = { as: name.peek(), of: opened.peek() };
}

/** Take what was printed; it is drawn with the next picture, however often something is printed until then. */
function print(output: Output) {
  if (!printed.length) requestAnimationFrame(draw);
  if (printed.push(output) > MOST_WAITING) [printed, count] = [printed.slice(MOST_WAITING / 2), count + 1];
}

function draw() {
  const found = lines.value.slice();
  for (const { text, is_error: isError } of printed) {
    const parts = text.split("\n"),
      last = found.at(-1);
    if (last && (last.isError === isError || !last.text)) [parts[0], count] = [found.pop()!.text + parts[0], count - 1];
    count += parts.length;
    const kept = parts.slice(-MOST_LINES),
      first = count - kept.length;
    kept.forEach((part, k) => {
      const text = part.length > LONGEST_LINE ? `${part.slice(0, LONGEST_LINE)} …` : part;
      found.push({ number: first + k, text, isError });
    });
  }
  lines.value = found.slice(-MOST_LINES);
  printed = [];
}

// -- what it is asked --

onTold.take = (message) => (message.type === "output" ? print(message) : (program.value = message));

let runs = 0;

/** Run what stands in the editor; it is saved first. Before Python is loaded, it waits for that. */
export async function run() {
  if (program.value.state === "paused") return goOn("on");
  if (program.value.state === "running") return;
  save(true);
  isWaiting.value = loading.value !== "";
  if (isWaiting.value) return;
  runs++;
  clear();
  program.value = { ...IDLE, state: "running" }; // until Python says more: a second Run begins nothing
  const begun = await ask("run_program", {
    text: textNow(),
    name: name.value,
    imported: lab.value ? {} : imported(), // what is handed in is one file
    robot: robot.value,
    speed: speed.value,
    breakpoints: breakpoints.value,
    ...(lab.value && { lab: lab.value.name }),
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
  print({ type: "output", text: "The program did not stop by itself, and was ended.\n", is_error: true });
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

// A real robot does not stand still with its program.
effect(() => void (program.value.state === "paused" && halt()));
effect(() => {
  const lines = breakpoints.value;
  if (here.peek().state !== "idle") tell("set_breakpoints", { lines });
});
effect(() => {
  const now = { speed: speed.value };
  if (program.peek().state !== "idle") tell("set_pace", now);
});
// What another program printed, and how it ended, says nothing of the one that is open now.
effect(() => {
  if (!opened.value || program.peek().state !== "idle") return;
  clear();
  program.value = IDLE;
});
const named = computed(() => NAMED.exec((revision.value, textNow()))?.[1] ?? "sim://");
// Before a run, the world that the program names stands there, with nobody driving.
effect(() => {
  const wanted = isReal.value ? null : { lab: lab.value?.name, robot: robot.value || named.value };
  if (loading.value) return;
  if (isWaiting.peek()) run();
  else if (wanted && program.peek().state === "idle") tell("show_world", wanted);
});
