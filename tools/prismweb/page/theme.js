// SPDX-License-Identifier: MIT
// Light or dark theme: that of the system, or the user's choice.
const kChoices = ["system", "light", "dark"];
const kKey = "prism-theme";
const kLabels = { system: "◐ system", light: "☀ light", dark: "☾ dark" };

/** Connects the button; changed(isPrinted) is called after each change of the theme. Print is light. */
export function startTheme(button, changed) {
  const system = matchMedia("(prefers-color-scheme: dark)");
  let choice = localStorage.getItem(kKey);
  if (!kChoices.includes(choice)) choice = "system";
  const apply = (isPrinted) => {
    const dark = !isPrinted && (choice === "dark" || (choice === "system" && system.matches));
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    button.textContent = kLabels[choice];
    button.setAttribute("aria-label", `theme: ${choice}; press for the next`);
    changed(isPrinted);
  };
  const next = () => {
    choice = kChoices[(kChoices.indexOf(choice) + 1) % kChoices.length];
    localStorage.setItem(kKey, choice);
    apply(false);
  };
  button.addEventListener("click", next);
  system.addEventListener("change", () => apply(false));
  addEventListener("beforeprint", () => apply(true));
  addEventListener("afterprint", () => apply(false));
  apply(false);
  return next;
}
