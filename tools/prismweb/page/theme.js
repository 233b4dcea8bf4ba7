// SPDX-License-Identifier: MIT
// Light or dark: as the system says, unless somebody chose.
const kChoices = ["system", "light", "dark"];
const kKey = "prism-theme";
const kWords = { system: "◐ system", light: "☀ light", dark: "☾ dark" };

/** Wires the switch; `changed` is called whenever the colours are others than before. */
export function startTheme(button, changed) {
  const system = matchMedia("(prefers-color-scheme: dark)");
  let choice = localStorage.getItem(kKey);
  if (!kChoices.includes(choice)) choice = "system";
  const apply = () => {
    const dark = choice === "dark" || (choice === "system" && system.matches);
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    button.textContent = kWords[choice];
    button.setAttribute("aria-label", `theme: ${choice}; press for the next`);
    changed();
  };
  const next = () => {
    choice = kChoices[(kChoices.indexOf(choice) + 1) % kChoices.length];
    localStorage.setItem(kKey, choice);
    apply();
  };
  button.addEventListener("click", next);
  system.addEventListener("change", apply);
  apply();
  return next;
}
