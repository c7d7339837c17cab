// Light or dark: as the computer has it, or as the person chose on this page.
import { effect, signal } from "@preact/signals";
import { media } from "./screen";

const KEY = "elib-theme";
const chosen = signal(localStorage.getItem(KEY));
const isSystemDark = media("(prefers-color-scheme: dark)");

export const isDark = () => (chosen.value ? chosen.value === "dark" : isSystemDark.value);

export function toggleTheme() {
  chosen.value = isDark() ? "light" : "dark";
  localStorage.setItem(KEY, chosen.value);
}

effect(() => {
  document.documentElement.dataset.theme = isDark() ? "dark" : "light";
});
