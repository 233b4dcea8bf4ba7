// SPDX-License-Identifier: MIT
// Saves the rows of the charts as a table.
import { el } from "./dom.js";
import { moment } from "./format.js";
import { kQuantities } from "./steps.js";

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
