// The serial port of a real robot. The window holds it and not the worker: it can stop the robot when Python is ended.
import { signal } from "@preact/signals";
import { toast } from "../store";

type Port = EventTarget & {
  readable: ReadableStream<Uint8Array>;
  writable: WritableStream<Uint8Array>;
  open: (options: { baudRate: number }) => Promise<void>;
  close: () => Promise<void>;
};
const serial = (navigator as { serial?: { requestPort: () => Promise<Port> } }).serial;

const BAUD = 115200; // what every firmware speaks
const NOTHING = new Uint8Array();

/** Whether a port is open. */
export const hasPort = signal(false);
let writer: WritableStreamDefaultWriter<Uint8Array> | null = null;
let guard = NOTHING; // what stops the robot, while a program has it open
let say: (message: object) => void = () => {}; // to Python

/** Ask the person for a port, and open it. */
export async function choose() {
  if (!serial) return toast("This browser reaches no serial ports. Chrome, Edge and Opera on a computer do.");
  try {
    const port = await serial.requestPort();
    await port.open({ baudRate: BAUD });
    writer = port.writable.getWriter();
    hasPort.value = true;
    say({});
    lose(await read(port).catch((error: Error) => error.message));
    await port.close();
  } catch (error) {
    if ((error as Error).name !== "NotFoundError") toast(`The port cannot be opened: ${(error as Error).message}`);
  }
}

async function read(port: Port) {
  const reader = port.readable.getReader();
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return "the port was closed";
    say(value);
  }
}

function lose(why: string) {
  writer = null;
  hasPort.value = false;
  say({ lost: why });
}

/** Take another Python as the one that speaks to the robot. */
export function speakWith(python: (message: object) => void) {
  halt();
  guard = NOTHING;
  say = python;
  if (hasPort.value) say({});
}

/** Do what Python asks for: write, or remember what stops the robot. */
export function obey({ write, guard: stop }: { write?: Uint8Array; guard?: Uint8Array<ArrayBuffer> }) {
  if (write) writer?.write(write).catch((error: Error) => lose(error.message));
  if (stop) guard = stop;
}

/** Stop the robot, if a program has it open. */
export function halt() {
  if (guard.length) writer?.write(guard).catch(() => {});
}

addEventListener("pagehide", halt);
