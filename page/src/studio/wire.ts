// Python, which runs in a worker of this page: how far it is loaded, and how it is ended.
import { signal } from "@preact/signals";
import { connect, hear } from "../store";

const NOTHING = { word: "Loading Python", share: 0 };
/** What is loaded, and how much of it is; null once Python is there. */
export const loading = signal<{ word: string; share: number } | null>(NOTHING);
let worker: Worker;

export function begin() {
  loading.value = NOTHING;
  worker = new Worker("worker.js", { type: "module" });
  worker.onmessage = ({ data }) => {
    if (data.word) return (loading.value = data);
    if (loading.value) {
      loading.value = null;
      connect((text) => worker.postMessage(text));
    }
    hear(data);
  };
}

export function restart() {
  worker.terminate();
  connect(null);
  begin();
}
