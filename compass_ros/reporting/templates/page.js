// The theme follows the system until the reader chooses.
const dark = matchMedia("(prefers-color-scheme: dark)");
const redraw = () => redraws.forEach((paint) => paint());
dark.addEventListener("change", redraw);
document.getElementById("theme").addEventListener("click", () => {
  const root = document.documentElement, now = root.dataset.theme || (dark.matches ? "dark" : "light");
  root.dataset.theme = now === "dark" ? "light" : "dark";
  redraw();
});
