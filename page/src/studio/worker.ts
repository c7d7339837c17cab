// The worker of the studio: it loads Python and elib from the folder that it lies in, and carries their messages.
import { type Lockfile, loadPyodide } from "pyodide";

// What the build writes: the wheels beside this file, and what Pyodide wants to know of packages.
declare const WHEELS: string[];
declare const LOCK: Lockfile;
/** What Python calls, and how messages go to the page. */
const scope = self as unknown as Worker & {
  nap: (ms: number) => Promise<void>;
  write: (data: Uint8Array) => void;
  guard: (data: Uint8Array) => void;
  begin: (work: { callPromising: () => Promise<void>; destroy: () => void }) => void;
};
// A program has these no more: what the browser keeps of other programs and of the studio, workers that would have all
// of it again, ports that the window was allowed to open, and once Python is loaded, the network.
const STORES = ["caches", "indexedDB", "BroadcastChannel", "SharedWorker", "Worker"];
const DEVICES = ["hid", "serial", "storage", "usb"];
const NETWORK = ["EventSource", "WebSocket", "WebSocketStream", "WebTransport", "XMLHttpRequest", "fetch"];
const HERE = new URL(".", import.meta.url).href;

let wake: () => void; // ends the nap: what has come is not to wait for its end
scope.nap = (ms) =>
  new Promise((resolve) => {
    wake = resolve;
    setTimeout(resolve, ms);
  });
scope.write = (write) => scope.postMessage({ write });
scope.guard = (guard) => scope.postMessage({ guard });
scope.begin = (work) => setTimeout(() => work.callPromising().finally(() => work.destroy()));

/** Send a text, or the bytes of a frame, whose memory goes along. */
function post(message: string | Uint8Array<ArrayBuffer>) {
  if (typeof message === "string") scope.postMessage(message);
  else scope.postMessage(message.buffer, [message.buffer]);
}

function remove(names: string[], of: object) {
  for (let object = of; object; object = Object.getPrototypeOf(object))
    for (const name of names) delete object[name as keyof typeof object];
}

const tell = (word: string, share: number) => scope.postMessage({ word, share });

async function fetched(name: string) {
  const answer = await fetch(HERE + name);
  if (!answer.ok) throw new Error(`${name}: ${answer.status} ${answer.statusText}`);
  return answer.arrayBuffer();
}

async function begin() {
  if (!("Suspending" in WebAssembly)) throw new Error("this browser is too old: its WebAssembly cannot wait");
  tell("Loading Python", 0.1);
  remove(STORES, self);
  remove(DEVICES, navigator);
  const wheels = WHEELS.map(fetched);
  const python = await loadPyodide({ indexURL: HERE, lockFileContents: LOCK });
  tell("Loading elib", 0.6);
  const [extractDir] = python.runPython("import site; site.getsitepackages()");
  for (const wheel of wheels) python.unpackArchive(await wheel, "wheel", { extractDir });
  remove(NETWORK, self);
  tell("Starting elib", 0.8);
  const studio = python.pyimport("elib.studio.worker").start(post);
  scope.onmessage = ({ data }) => {
    if (typeof data === "string") studio.hear(data);
    else if (data instanceof Uint8Array) studio.receive(data);
    else if (data.lost) studio.port.lost(data.lost);
    else studio.port.opened();
    wake?.();
  };
}

begin().catch((error) => tell(`Python cannot be loaded. Reload the page to try again. ${error}`, 0));
