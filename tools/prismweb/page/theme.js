// SPDX-License-Identifier: MIT
// Light or dark theme: that of the system, or the user's choice.
const kChoices = ["system", "light", "dark"];
const kKey = "prism-theme";
const kLabels = { system: "◐ system", light: "☀ light", dark: "☾ dark" };

/** Connects the button; `changed` is called after each change of the theme. */
export function startTheme(button, changed) {
  const system = matchMedia("(prefers-color-scheme: dark)");
  let choice = localStorage.getItem(kKey);
  if (!kChoices.includes(choice)) choice = "system";
  const apply = () => {
    const dark = choice === "dark" || (choice === "system" && system.matches);
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    button.textContent = kLabels[choice];
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
