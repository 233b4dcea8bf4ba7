// SPDX-License-Identifier: MIT
// Counters and timing of the line, as in `prismctl line`.
import { el, setText } from "./dom.js";
import { count, fixed, kUnknown } from "./charts/format.js";

/** Returns [label, value] pairs for a `line` response. Exported for its test. */
export function lineRows(line) {
  if (!line) return [];
  const { decoder = {}, timing = {}, hardware } = line;
  const parts_per_million = 1e6 * (timing.period_s / line.nominal_period_s - 1);
  const errors = hardware && Object.entries(hardware).filter(([, value]) => value > 0).map(([name, value]) => `${count(value)} ${name}`).join(", ");
  return [
    ["device", `${line.device ?? kUnknown}${line.baud ? `, ${count(line.baud)} baud` : ""}`],
    ["frames good", count(decoder.frames)],
    ["rejected: checksum, length, content, fault", [decoder.bad_check, decoder.bad_length, decoder.bad_body, decoder.refused ?? 0].map(count).join(", ")],
    ["bytes skipped, resyncs, timeouts", [decoder.skipped_bytes, decoder.resyncs, decoder.timeouts].map(count).join(", ")],
    ["frames missing, duplicate; resets", [timing.missing_frames, timing.duplicates, timing.resets].map(count).join(", ")],
    ["period", `${fixed(1000 * timing.period_s, 6)} ms, ${fixed(parts_per_million, 1)} ppm off nominal`],
    ["hardware errors", hardware ? errors || "none" : "not counted by this device"],
    ...(line.notes ?? []).map((note) => ["note", note]),
  ];
}

export function makeLinePanel() {
  const list = el("dl", { class: "line" });
  let drawn = "";
  return {
    element: list,
    draw(line) {
      const rows = lineRows(line), labels = rows.map(([label]) => label).join("\n");
      if (labels !== drawn) list.replaceChildren(...rows.map(([label]) => el("div", {}, el("dt", {}, label), el("dd", { class: "value" }))));
      drawn = labels;
      rows.forEach(([, value], i) => setText(list.children[i].lastChild, value));
    },
  };
}
