// SPDX-License-Identifier: MIT
// Elements made by hand: every text goes in as text, so that no name of a gyro or a model is ever markup.
import { kUnknown } from "./charts/format.js";

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

/** Writes only what changed: a live region then speaks only when there is something to say. */
export function setText(element, text) {
  if (element.textContent === text) return;
  element.textContent = text;
  element.classList.toggle("unknown", text === kUnknown); // a dash that is struck is a bar
}

export function setAttribute(element, name, value) {
  if (element.getAttribute(name) !== value) element.setAttribute(name, value);
}

/** A colour that the style sheet names, such as "--raw", as the present theme has it. */
export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
