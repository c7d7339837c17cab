// How much room there is, and what the computer is set to.
import { signal } from "@preact/signals";

/** Whether a media query holds, as it changes. */
export function media(query: string) {
  const list = matchMedia(query),
    holds = signal(list.matches);
  list.addEventListener("change", ({ matches }) => (holds.value = matches));
  return holds;
}

const phone = media("(max-width: 720px), (max-height: 500px)");

/** Whether the page is as narrow, or as low, as a phone. */
export const isPhone = () => phone.value;
