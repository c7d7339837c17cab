// Python, which runs in a worker of this page: how far it is loaded, and how it is ended.
import { signal } from "@preact/signals";
import { connect, hear, tell } from "../store";
import { confined } from "./confined";
import { obey, speakWith } from "./serial";

const QUIET = 3000; // ms after Python is there until another is loaded, in case that this one has to be ended

/** What is loaded, and how much of it, in words; empty once Python is there. */
export const loading = signal("Loading Python");
/** Labs that were opened, zipped, by name: each Python is told of them before anything else. */
export const zippedLabs = new Map<string, string>();
type Python = { worker: Worker; said: MessageEvent[] };
let python: Python;
let spare: Python | null = null;

function load(): Python {
  const worker = confined(),
    said: MessageEvent[] = []; // while nobody listens
  worker.onmessage = (event) => said.push(event);
  return { worker, said };
}

export function begin() {
  const { worker, said } = (python = spare ?? load());
  spare = null;
  loading.value = "Loading Python";
  worker.onmessage = ({ data }) => {
    const { word, share } = data;
    if (word) return (loading.value = share ? `${word} … ${Math.round(100 * share)} %` : word);
    if (loading.value) {
      connect((text) => worker.postMessage(text));
      speakWith((message) => worker.postMessage(message));
      for (const zip of zippedLabs.values()) tell("open_lab_folder", { zip });
      setTimeout(() => (spare ??= load()), QUIET);
    }
    loading.value = "";
    if (data.write || data.guard) obey(data);
    else hear(data);
  };
  for (const event of said) worker.onmessage(event);
}

export function restart() {
  python.worker.terminate();
  connect(null);
  speakWith(() => {});
  begin();
}
