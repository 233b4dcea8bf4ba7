// SPDX-License-Identifier: MIT
// Makes and measures elements. Texts are never parsed as markup, because they may be names of gyros and models.
import { kUnknown } from "./format.js";

const kSvg = "http://www.w3.org/2000/svg";

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (typeof value === "function") element.addEventListener(name, value);
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

/** el("button", {class: "x", click: handler}, "text", child …). */
export const el = (tag, attributes = {}, ...children) => fill(document.createElement(tag), attributes, children);

export const svg = (tag, attributes = {}, ...children) => fill(document.createElementNS(kSvg, tag), attributes, children);

/** Writes the text only if it changed, because a screen reader announces each write to a live region. */
export function setText(element, text) {
  if (element.textContent === text) return;
  element.textContent = text;
  element.classList.toggle("unknown", text === kUnknown); // the style sheet does not cross out a dash
}

export function setAttribute(element, name, value) {
  if (element.getAttribute(name) !== value) element.setAttribute(name, value);
}

/** Returns a colour of the current theme by its name in the style sheet, e.g. "--raw". */
export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Reports the time from `begin_ms` (0: start of the navigation) until now to a PerformanceObserver. An entry that is kept would fill the memory. */
export function measured(name, begin_ms = 0) {
  performance.measure(name, { start: begin_ms, end: performance.now() });
  performance.clearMeasures(name);
}
