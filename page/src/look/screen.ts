// How much room there is.
import { signal } from "@preact/signals";

const narrow = matchMedia("(max-width: 720px), (max-height: 500px)");
const phone = signal(narrow.matches);
narrow.addEventListener("change", ({ matches }) => (phone.value = matches));

/** Whether the page is as narrow, or as low, as a phone. */
export const isPhone = () => phone.value;
