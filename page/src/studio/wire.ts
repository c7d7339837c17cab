// Python, which runs in a worker of this page: how far it is loaded, and how it is ended.
import { signal } from "@preact/signals";
import { connect, hear } from "../store";

/** What is loaded, and how much of it, in words; empty once Python is there. */
export const loading = signal("Loading Python");
let worker: Worker;

export function begin() {
  loading.value = "Loading Python";
  worker = new Worker("worker.js", { type: "module" });
  worker.onmessage = ({ data }) => {
    const { word, share } = data;
    if (word) return (loading.value = share ? `${word} … ${Math.round(100 * share)} %` : word);
    if (loading.value) connect((text) => worker.postMessage(text));
    loading.value = "";
    hear(data);
  };
}

export function restart() {
  worker.terminate();
  connect(null);
  begin();
}
