// The programs of this browser: kept under their names, read from files and links, and put into links.
import { batch, computed, signal } from "@preact/signals";
import { toast } from "../store";
import { known } from "./known";
import type { LabNews } from "./messages";

const KEPT = "elib-program:"; // before the name, in the browser's storage
const LAST = "elib-last-program";
const PAUSE = 300; // ms after a key until the program is saved
const LONGEST = 200_000; // letters of a program that is opened: a short link could become any length
export const LONGEST_LINK = 30_000; // letters; programs that pass messages on cut longer ones
const FULL = "Not saved: the browser's storage is full. Delete a program, or save this one as a file.";
const FIRST = `import elib

with elib.connect("sim://arena") as robot:
    robot.set_speed(0.3, 0.3)
    while max(robot.proximity()) < 1000:  # higher is nearer
        robot.sleep(0.05)
    robot.stop()
    print("There is something near me.")
`;
const NEW = `import elib

with elib.connect("sim://arena") as robot:
    robot.drive(0.1)  # m
`;

const stored = (name: string) => localStorage.getItem(KEPT + name);
const listed = () => Object.keys(localStorage).flatMap((key) => (key.startsWith(KEPT) ? key.slice(KEPT.length) : []));

/** A name that no program has: "square.py", or else "square-2.py". */
function free(wanted: string) {
  const stem = wanted.replace(/\.py$|[^\p{L}\p{N} ._()-]/gu, "").slice(0, 60) || "program";
  let found = `${stem}.py`;
  for (let count = 2; stored(found) !== null; count++) found = `${stem}-${count}.py`;
  return found;
}

/** The program as it was opened; what stands in the editor since then is `text`. */
export const opened = signal({ name: "program.py", text: FIRST });
export const name = signal(opened.value.name);
export const names = signal(listed());
/** The lab that it is for. */
export const lab = signal<LabNews | null>(null);
/** Where the program is from if it is not one's own: it is kept only when it is changed or run, under a free name. */
const borrowed = signal("A first program");
export const isOwn = computed(() => !borrowed.value);
/** Why the program cannot be kept. */
export const unsaved = signal("");
export const note = computed(() => unsaved.value || borrowed.value || "Saved in this browser");
let text = FIRST;
let isChanged = false;
let timer = 0;

export const textNow = () => text;
export const revision = signal(0); // counts the changes of the text

/** Note what stands in the editor; it is saved at the next pause. */
export function edit(now: string) {
  text = now;
  revision.value++;
  isChanged = true;
  clearTimeout(timer);
  timer = setTimeout(save, PAUSE);
}

/** Keep the program as it stands; what was borrowed is one's own from then on. Return whether it is kept. */
export function save(even = false) {
  clearTimeout(timer);
  if (!isChanged && !even) return true;
  const kept = borrowed.value ? free(name.value) : name.value;
  try {
    localStorage.setItem(KEPT + kept, text);
    localStorage.setItem(LAST, kept);
  } catch {
    isChanged = true;
    unsaved.value = FULL;
    return false;
  }
  isChanged = false;
  if (borrowed.value) history.replaceState(null, "", location.pathname + location.search); // the link has done its work
  unsaved.value = borrowed.value = "";
  name.value = kept;
  names.value = listed();
  return true;
}

/** Show a program in place of the one before, which is saved: *from* says where it is from if it is not one's own. */
function show(next: typeof opened.value, from: string, of: LabNews | null) {
  if (!save()) return toast(FULL);
  text = next.text;
  batch(() => {
    name.value = next.name;
    borrowed.value = from;
    lab.value = of;
    opened.value = next;
    revision.value++;
  });
  if (!from) save(true);
}

/** The programs of this browser that this one imports, and those that they import. */
export function imported() {
  const found: Record<string, string> = {};
  const look = (text: string) => {
    for (const [line] of text.matchAll(/^\s*(from|import)\b.*/gm))
      for (const [word] of line.matchAll(/\w+/g)) {
        const file = `${word}.py`,
          its = stored(file);
        if (its === null || file in found) continue;
        found[file] = its;
        look(its);
      }
  };
  look(text);
  return found;
}

export const borrow = (name: string, text: string, from: string, of: LabNews | null = null) =>
  show({ name, text }, from, of);
export const begin = () => borrow(free("program"), NEW, "New: it is kept when you change or run it");
export const beginMachine = () => borrow(free("states"), known.value.machine, "New");

/** Open a program of this browser, or a text that begins it. */
export function open(name: string, beginning = FIRST, from = "New", of: LabNews | null = null) {
  const found = stored(name);
  show({ name, text: found ?? beginning }, found === null ? from : "", of);
}

export function rename(wanted: string) {
  if (wanted === name.value || !save()) return;
  const old = isOwn.value && name.value; // of what is not kept, another may have the name
  name.value = wanted;
  borrowed.value = "renamed"; // so the name that it gets is free
  if (save(true) && old) localStorage.removeItem(KEPT + old);
  names.value = listed();
}

export function forget() {
  clearTimeout(timer);
  isChanged = false;
  if (isOwn.value) localStorage.removeItem(KEPT + name.value); // of what is not kept, another may have the name
  names.value = listed();
  open(names.value[0] ?? "program.py");
}

export async function openFile(file: File) {
  if (file.size > LONGEST) return toast(`${file.name} is too long for a program`);
  borrow(file.name, (await file.text()).replaceAll("\r\n", "\n"), "From a file");
}

// -- links --

/** The address that opens this program elsewhere. */
export async function link() {
  const packed = new Response(new Blob([text]).stream().pipeThrough(new CompressionStream("deflate-raw"))),
    data = (await packed.bytes()).toBase64({ alphabet: "base64url", omitPadding: true });
  return `${location.href.split("#")[0]}#program=${encodeURIComponent(name.value)},${data}`;
}

/** Show the program that the address carries, if it does; it is read, and never run. */
export async function openLink() {
  const [, called, data] = /^#program=([^,]*),(.*)$/.exec(location.hash) ?? [];
  if (data === undefined) return;
  try {
    const packed = new Blob([Uint8Array.fromBase64(data, { alphabet: "base64url" })]).stream(),
      unpacked = packed.pipeThrough(new DecompressionStream("deflate-raw"));
    let found = "";
    for await (const part of unpacked.pipeThrough(new TextDecoderStream("utf-8", { fatal: true })))
      if ((found += part).length > LONGEST) throw new Error("too long");
    borrow(free(decodeURIComponent(called)), found, "From a link: read it before you run it");
  } catch {
    toast("The program in this link is broken or too long. Ask for the link again, and copy all of it.");
  }
}

// -- what the window is told --

open(localStorage.getItem(LAST) ?? "program.py", FIRST, "A first program");
addEventListener("hashchange", openLink);
addEventListener("pagehide", () => save());
addEventListener("beforeunload", (event) => save() || event.preventDefault());
addEventListener("storage", ({ key }) => {
  if (key === KEPT + name.value) borrowed.value ||= "Changed in another window: what you change here gets a new name";
  names.value = listed();
});
