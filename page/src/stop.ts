// STOP: it asks no one and waits for nothing.
import { computed, signal } from "@preact/signals";
import { isWriting } from "./look/keys";
import { place } from "./route";
import { robotOf, tell } from "./store";

/** How often stop was pressed on this page: whoever holds a stick lets go of it when this changes. */
export const stops = signal(0);

/** The robot that STOP stops; empty for all of them, as where a recording is shown while the robots drive on. */
export const stopped = computed(() => {
  const { robot } = place.value,
    phase = (robot && robotOf(robot).tick.value?.phase) || "disconnected";
  return ["connecting", "connected", "gap"].includes(phase) ? robot : "";
});

export function stop() {
  stops.value++;
  tell("stop", stopped.value ? { robot: stopped.value } : {});
}

function press(event: KeyboardEvent) {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const isSpace = event.code === "Space" && !isWriting(event.target);
  if (!isSpace && event.key !== "Escape") return;
  if (isSpace) {
    event.preventDefault(); // a button that has the focus is not pressed by it, for it could start something
    event.stopPropagation();
  }
  if (!event.repeat) stop();
}

window.addEventListener("keydown", press, true);
window.addEventListener(
  "keyup",
  (event) => {
    if (event.code === "Space" && !isWriting(event.target)) event.preventDefault();
  },
  true,
);
