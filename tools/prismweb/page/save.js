// SPDX-License-Identifier: MIT
// What the charts show, as a picture and as a table.
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
 * The rows as CSV: time, and of each quantity least, mean and greatest of its step; empty where it is unknown, and where the step has no such
 * value (`parts`, of Steps). A comment has nothing that begins another cell: one with "=" would be a formula.
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

/** Draws an element's text where it stands, relative to `origin`. */
function drawText(context, element, origin, font) {
  const box = element.getBoundingClientRect(), align = getComputedStyle(element).textAlign;
  context.font = font;
  context.textAlign = align === "right" || align === "center" ? align : "left";
  const x = align === "right" ? box.right : align === "center" ? (box.left + box.right) / 2 : box.left;
  context.fillText(element.textContent, x - origin.left, (box.top + box.bottom) / 2 - origin.top);
}

/** All charts below each other with their titles, scales and legends, twice as fine as on the screen. */
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
      const place = layer.getBoundingClientRect();
      context.drawImage(layer, place.left - origin.left, place.top - origin.top, place.width, place.height);
    }
    context.fillStyle = colour("--faint");
    for (const label of chart.plot.querySelectorAll(".dygraph-axis-label")) drawText(context, label, origin, "11px system-ui, sans-serif");
    context.fillStyle = colour("--ink");
    drawText(context, chart.title, origin, "600 13px system-ui, sans-serif");
    chart.element.querySelectorAll(".legend li").forEach((entry, i) => {
      context.fillStyle = colour(chart.spec.series[i].colour);
      const place = entry.querySelector(".swatch").getBoundingClientRect();
      context.fillRect(place.left - origin.left, (place.top + place.bottom) / 2 - origin.top - 1.5, place.width, 3);
      context.fillStyle = colour("--ink");
      drawText(context, entry.querySelector(".label"), origin, "12px system-ui, sans-serif");
    });
  }
  return canvas;
}

export const savePng = (name, strips, head) => pictureOf(strips, head).toBlob((blob) => download(`${name}.png`, blob), "image/png");
