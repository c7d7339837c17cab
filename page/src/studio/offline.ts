// Once Python is loaded, the browser keeps the studio, which then opens without a network.
import { effect } from "@preact/signals";
import { loading } from "./wire";

effect(() => {
  if (!loading.value) navigator.serviceWorker?.register("service.js").catch(() => {}); // a private window keeps nothing
});
