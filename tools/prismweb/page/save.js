// SPDX-License-Identifier: MIT
// Saves the charts as a picture and their rows as a table.
import { colour, el } from "./dom.js";
import { moment } from "./charts/format.js";
import { kQuantities } from "./steps.js";

const kMargin_px = 16, kHead_px = 52;

function download(name, blob) {
  const url = URL.createObjectURL(blob), link = el("a", { href: url, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}

/**
 * Returns the rows as CSV: time, and minimum, mean and maximum of each quantity; empty if unknown or if the steps do not have this value
 * (`parts` of Steps). Comments contain no separators, because a cell that starts with "=" would be a formula.
 */
export function csvOf(rows, step_s, about, parts = {}) {
  const quantities = Object.entries(kQuantities).filter(([name]) => rows.some((row) => row[name]));
  const lines = about.map((line) => `# ${line.replace(/[\r\n,;\t"]+/g, " ")}`);
  lines.push(`# step_s: ${step_s}`);
  lines.push(["time_utc", "time_s", ...quantities.flatMap(([, member]) => ["min", "mean", "max"].map((part) => `${part}_${member}`))].join(","));
  const number = (value) => (Number.isFinite(value) ? String(Number(value.toPrecision(12))) : "");
  for (const row of rows) {
    const cells = quantities.flatMap(([name]) => [0, 1, 2].map((part) => (parts[name]?.[part] === false ? "" : number(row[name]?.[part]))));
    lines.push([moment(row.end_s).replace(" ", "T") + "Z", row.end_s, ...cells].join(","));
  }
  return lines.join("\n") + "\n";
}

export const saveCsv = (name, ...table) => download(`${name}.csv`, new Blob([csvOf(...table)], { type: "text/csv" }));

/** Draws an element's text at its position relative to `origin`. */
function drawText(context, element, origin, font) {
  const box = element.getBoundingClientRect(), align = getComputedStyle(element).textAlign;
  context.font = font;
  context.textAlign = align === "right" || align === "center" ? align : "left";
  const x = align === "right" ? box.right : align === "center" ? (box.left + box.right) / 2 : box.left;
  context.fillText(element.textContent, x - origin.left, (box.top + box.bottom) / 2 - origin.top);
}

/** Returns a canvas with all charts, their titles, scales and legends, with twice the resolution of the screen. */
export function pictureOf(strips, head) {
  strips.drawAll();
  const canvas = document.createElement("canvas"), box = strips.element.getBoundingClientRect(), scale = 2;
  canvas.width = (box.width + 2 * kMargin_px) * scale;
  canvas.height = (box.height + kHead_px + kMargin_px) * scale;
  const context = canvas.getContext("2d");
  context.scale(scale, scale);
  context.fillStyle = colour("--paper");
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.fillStyle = colour("--ink");
  context.textBaseline = "middle";
  context.font = "600 15px system-ui, sans-serif";
  context.fillText(head[0], kMargin_px, 18);
  context.font = "12px system-ui, sans-serif";
  context.fillText(head[1], kMargin_px, 38);
  const origin = { left: box.left - kMargin_px, top: box.top - kHead_px };
  for (const chart of strips.charts) {
    for (const layer of chart.plot.querySelectorAll("canvas")) {
      const rect = layer.getBoundingClientRect();
      context.drawImage(layer, rect.left - origin.left, rect.top - origin.top, rect.width, rect.height);
    }
    context.fillStyle = colour("--faint");
    for (const label of chart.plot.querySelectorAll(".dygraph-axis-label")) drawText(context, label, origin, "11px system-ui, sans-serif");
    context.fillStyle = colour("--ink");
    drawText(context, chart.title, origin, "600 13px system-ui, sans-serif");
    chart.element.querySelectorAll(".legend li").forEach((entry, i) => {
      context.fillStyle = colour(chart.spec.series[i].colour);
      const rect = entry.querySelector(".swatch").getBoundingClientRect();
      context.fillRect(rect.left - origin.left, (rect.top + rect.bottom) / 2 - origin.top - 1.5, rect.width, 3);
      context.fillStyle = colour("--ink");
      drawText(context, entry.querySelector(".label"), origin, "12px system-ui, sans-serif");
    });
  }
  return canvas;
}

export const savePng = (name, strips, head) => pictureOf(strips, head).toBlob((blob) => download(`${name}.png`, blob), "image/png");
