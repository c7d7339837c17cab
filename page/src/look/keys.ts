// Which keys belong to the control that has the focus. All others drive, or stop.
import { signal } from "@preact/signals";

/** What the arrow keys move in the world; while they do, only the letters drive. */
export const arrowsMove = signal("");

const TAKES_KEYS = "textarea, select, [contenteditable=true], [data-keys], [role=listbox], dialog";
const TAKES_ARROWS = "input[type=range], input[type=radio], [role=tab]";

/** Whether somebody writes there. */
export function isWriting(target: EventTarget | null) {
  if (!(target instanceof Element)) return false;
  if (target.closest("textarea, [contenteditable=true], [data-writes]")) return true;
  return target instanceof HTMLInputElement && !["checkbox", "radio", "range", "button"].includes(target.type);
}

/** Whether a key belongs to what has the focus, as in a field one writes in or a list one chooses from. */
export function isBusy(target: EventTarget | null, isArrow: boolean) {
  if (!(target instanceof Element)) return false;
  return isWriting(target) || target.closest(isArrow ? `${TAKES_KEYS}, ${TAKES_ARROWS}` : TAKES_KEYS) !== null;
}
