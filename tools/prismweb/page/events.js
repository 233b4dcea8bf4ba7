// SPDX-License-Identifier: MIT
// The last events of a gyro, newest first. A click on an event moves the charts to its time.
import { el } from "./dom.js";
import { moment } from "./charts/format.js";
import { kMarks, levelOfSeverity } from "./quality.js";

const kShown = 60;

export function makeEvents(lookAt) {
  const list = el("ol", { class: "events" });
  let drawn = "";
  const entry = (event) => {
    const level = levelOfSeverity(event.severity), repeats = event.repeats ? ` (${event.repeats} more times)` : "";
    return el("li", { class: level }, el("button", { type: "button", click: () => lookAt(event.time_s) },
      el("span", { class: "mark", "aria-label": event.severity }, kMarks[level]), el("time", {}, moment(event.time_s)), el("span", { class: "text" }, event.text + repeats)));
  };
  return {
    element: list,
    draw(events) {
      const last = events.at(-1), now = `${events.length} ${last?.time_s} ${last?.text} ${last?.repeats}`;
      if (now === drawn) return;
      drawn = now;
      list.replaceChildren(...events.slice(-kShown).reverse().map(entry));
    },
  };
}
