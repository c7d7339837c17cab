// Light and dark: as the system has it, until a person chooses.

const system = matchMedia("(prefers-color-scheme: dark)");

/** @param {boolean} isDark */
function dress(isDark) {
  document.documentElement.dataset.theme = isDark ? "dark" : "light";
}

function follow() {
  const chosen = localStorage.getItem("elib-theme");
  dress(chosen ? chosen === "dark" : system.matches);
}

system.addEventListener("change", follow);
follow();
document.getElementById("theme")?.addEventListener("click", () => {
  const isDark = document.documentElement.dataset.theme !== "dark";
  localStorage.setItem("elib-theme", isDark ? "dark" : "light");
  dress(isDark);
});
