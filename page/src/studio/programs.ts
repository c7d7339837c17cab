// The programs of this browser: kept under their names, read from files and links, and put into links.
import { computed, signal } from "@preact/signals";
import { toast } from "../store";

const KEPT = "elib-program:"; // before the name, in the browser's storage
const LAST = "elib-last-program";
const PAUSE = 300; // ms after a key until the program is saved
const LONGEST = 200_000; // letters of a program that is opened
export const LONGEST_LINK = 30_000; // letters; programs that pass messages on cut longer ones
const FULL = "Not saved: the browser's storage is full. Delete a program, or save this one as a file.";
const FIRST = `import elib

with elib.connect("sim://arena") as robot:
    robot.set_speed(0.3, 0.3)
    while max(robot.proximity()) < 300:
        robot.sleep(0.05)
    robot.stop()
    print("There is something in front of me.")
`;

type Opened = { name: string; text: string };

const stored = (name: string) => localStorage.getItem(KEPT + name);

/** Where the program is from if it is not one's own: it is kept only when it is changed or run, under a free name. */
const borrowed = signal("");
/** The program as it was opened; what stands in the editor since then is `text`. */
export const opened = signal<Opened>(first());
export const name = signal(opened.value.name);
export const names = signal(listed());
export const unsaved = signal(""); // why the program cannot be kept
export const note = computed(() => unsaved.value || borrowed.value || "Saved in this browser");
let text = opened.value.text;
let isChanged = false;
let timer = 0;

function first(): Opened {
  const last = localStorage.getItem(LAST) ?? "",
    found = stored(last);
  if (found !== null) return { name: last, text: found };
  borrowed.value = "A first program";
  return { name: "program.py", text: FIRST };
}

function listed() {
  const all = Object.keys(localStorage).filter((key) => key.startsWith(KEPT));
  return all.map((key) => key.slice(KEPT.length)).sort();
}

/** A name that no program has: "square.py", or else "square-2.py". */
function free(wanted: string) {
  const stem =
    wanted
      .replace(/\.py$/, "")
      .replace(/[^\p{L}\p{N} ._()-]/gu, "")
      .slice(0, 60)
      .trim() || "program";
  for (let count = 1; ; count++) {
    const found = `${stem}${count > 1 ? `-${count}` : ""}.py`;
    if (stored(found) === null) return found;
  }
}

export const textNow = () => text;

/** Note what stands in the editor; it is saved at the next pause. */
export function edit(now: string) {
  text = now;
  isChanged = true;
  clearTimeout(timer);
  timer = setTimeout(save, PAUSE);
}

/** Keep the program as it stands; what was borrowed is one's own from then on. */
export function save(even = false) {
  clearTimeout(timer);
  if (!isChanged && !even) return;
  const kept = borrowed.value ? free(name.value) : name.value;
  try {
    localStorage.setItem(KEPT + kept, text);
    localStorage.setItem(LAST, kept);
  } catch {
    isChanged = true;
    unsaved.value = FULL;
    return;
  }
  isChanged = false;
  if (borrowed.value) history.replaceState(null, "", location.pathname + location.search); // the link has done its work
  unsaved.value = borrowed.value = "";
  name.value = kept;
  names.value = listed();
}

/** Show another program, one's own or a borrowed one; the one before is saved. */
function show(next: Opened, from = "") {
  save();
  if (isChanged) return toast(FULL);
  text = next.text;
  name.value = next.name;
  borrowed.value = from;
  opened.value = next;
  if (!from) save(true);
}

/** Show a program that is not one's own: *from* says where it is from. */
export const borrow = (name: string, text: string, from: string) => show({ name, text }, from);

/** Open a program of this browser, or a text that begins it. */
export function open(name: string, beginning: string, from = "New") {
  const found = stored(name);
  show({ name, text: found ?? beginning }, found === null ? from : "");
}

export const begin = () => borrow(free("program"), FIRST, "New");

export function rename(wanted: string) {
  if (wanted === name.value) return;
  save(true);
  const old = name.value;
  if (isChanged) return;
  name.value = wanted;
  borrowed.value = "renamed"; // so the name that it gets is free
  save(true);
  if (!isChanged) localStorage.removeItem(KEPT + old);
  names.value = listed();
}

export function forget() {
  clearTimeout(timer);
  isChanged = false;
  localStorage.removeItem(KEPT + name.value);
  names.value = listed();
  if (names.value.length) open(names.value[0], "");
  else begin();
}

export async function openFile(file: File) {
  if (file.size > LONGEST) return toast(`${file.name} is too long for a program`);
  borrow(file.name, (await file.text()).replaceAll("\r\n", "\n"), "From a file");
}

// -- links --

const pipe = (bytes: BlobPart, way: CompressionStream | DecompressionStream) =>
  new Blob([bytes]).stream().pipeThrough(way as ReadableWritablePair<Uint8Array<ArrayBuffer>, Uint8Array<ArrayBuffer>>);

/** The address that opens this program elsewhere. */
export async function link() {
  const packed = await new Response(pipe(text, new CompressionStream("deflate-raw"))).bytes(),
    letters = btoa(Array.from(packed, (byte) => String.fromCharCode(byte)).join("")),
    data = letters.replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
  return `${location.href.split("#")[0]}#program=${encodeURIComponent(name.value)},${data}`;
}

/** Unpack a program, as far as one may be long: a few letters could become any length. */
async function unpacked(data: string) {
  const letters = atob(data.replaceAll("-", "+").replaceAll("_", "/")),
    decoder = new TextDecoder("utf-8", { fatal: true });
  let found = "";
  const reader = pipe(
    Uint8Array.from(letters, (letter) => letter.charCodeAt(0)),
    new DecompressionStream("deflate-raw"),
  ).getReader();
  for (let part; !(part = await reader.read()).done;) {
    found += decoder.decode(part.value, { stream: true });
    if (found.length > LONGEST) throw new Error("too long");
  }
  return found + decoder.decode();
}

/** Show the program that the address carries, if it does; it is read, and never run. */
export async function openLink() {
  const [, called, data] = /^#program=([^,]*),(.*)$/.exec(location.hash) ?? [];
  if (data === undefined) return;
  try {
    borrow(free(decodeURIComponent(called)), await unpacked(data), "From a link: read it before you run it");
  } catch {
    toast("The program in this link is broken or too long. Ask for the link again, and copy all of it.");
  }
}

addEventListener("hashchange", openLink);
addEventListener("pagehide", () => save());
addEventListener("visibilitychange", () => save());
addEventListener("beforeunload", (event) => isChanged && (save(), isChanged) && event.preventDefault());
// Another window has changed this program: what stands here becomes a program of its own when it is changed.
addEventListener("storage", ({ key }) => {
  if (key === KEPT + name.value)
    borrowed.value ||= "Changed in another window, too: what you change here gets a new name";
  names.value = listed();
});
