// The state machine of the program that is open: what Python reads in its text, and edits of it.
import { computed, effect, signal } from "@preact/signals";
import { ask, request, reason, toast } from "../store";
import { change, lookAt } from "./editor";
import type { Asked, Answered, Forms, MachineNews, Splice } from "./messages";
import { name, opened, revision, textNow } from "./programs";
import { isIdle } from "./run";
import { loading } from "./wire";

const PAUSE = 30; // ms of typing after which the text is read
const PLACES = "elib-places:"; // where a hand has put the states of a program, in this browser

type Edits = { [Name in keyof Answered]: Answered[Name] extends Splice[] ? Name : never }[keyof Answered];
type Place = [x: number, y: number];
/** What is selected in the picture. */
export type Chosen = { state: string } | { arrow: number } | null;

export const isOpen = signal(false);
export const machine = signal<MachineNews | null>(null); // that was read last, also while the text is wrong
const readText = signal("");
export const isBehind = computed(() => (revision.value, readText.value !== textNow())); // the picture
export const trouble = signal(""); // why the text has no picture now
export const chosen = signal<Chosen>(null);
export const drawnFrom = signal(""); // the state from which an arrow is being drawn
export const forms = signal<Forms>({ readings: [], actions: [] });

const places = (): Record<string, Place> => JSON.parse(localStorage.getItem(PLACES + name.value) ?? "{}");

export function put(state: string, place: Place) {
  try {
    localStorage.setItem(PLACES + name.value, JSON.stringify({ ...places(), [state]: place }));
  } catch {
    toast("This browser has no room left to keep where a state stands.");
  }
  return read();
}

export function layOut() {
  localStorage.removeItem(PLACES + name.value);
  return read();
}

async function read() {
  const text = textNow(),
    reply = await request("read_states", { text, places: places() });
  if (text !== textNow()) return; // it is read again
  trouble.value = reply?.ok ? "" : reason(reply);
  readText.value = text;
  if (reply?.ok) machine.value = reply.result as MachineNews;
}

/** Make an edit: it changes a few letters of the text, as one step that can be undone. Return whether it was made. */
export async function edit<Name extends Edits>(act: Name, values: Omit<Asked[Name], "text">) {
  if (isBehind.value) await read();
  const text = textNow(),
    reply = await request(act, { text, ...values } as Parameters<typeof request<Name>>[1]);
  if (!reply?.ok) return (toast(reason(reply)), false);
  if (text !== textNow()) return (toast("The text has changed meanwhile: do it again."), false);
  change((reply.result as Splice[]).map(({ begin, end, text }) => ({ from: begin, to: end, insert: text })));
  await read();
  return true;
}

let timer = 0;
effect(() => {
  revision.value; // each change of the text
  clearTimeout(timer);
  if (isOpen.value && !loading.value) timer = setTimeout(read, PAUSE);
});
effect(() => {
  const it = chosen.value,
    { states, arrows } = machine.peek() ?? { states: [], arrows: [] },
    found = it && ("state" in it ? states.find(({ name }) => name === it.state) : arrows[it.arrow]);
  if (found) lookAt(found.line, true); // what was clicked stays in view on a phone, too
});
effect(() => {
  if (!isIdle()) chosen.value = null; // the whole picture, to watch it
});
effect(() => {
  machine.value = chosen.value = null;
  drawnFrom.value = "";
  isOpen.value = /\bstates\(/.test(opened.value.text);
});
effect(() => {
  if (isOpen.value && !loading.value && !forms.peek().readings.length)
    ask("state_forms", {}).then((found) => found && (forms.value = found));
});
