// How much room there is.
import { signal } from "@preact/signals";

const narrow = matchMedia("(max-width: 720px)");
const phone = signal(narrow.matches);
narrow.addEventListener("change", ({ matches }) => (phone.value = matches));

/** Whether the page is as narrow as a phone that is held upright. */
export const isPhone = () => phone.value;
