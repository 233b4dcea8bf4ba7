// SPDX-License-Identifier: MIT
// All gyros and axes of the host: a tile for each axis, or a table of many.
import { el, setAttribute, setText, svg } from "./dom.js";
import { fixed, kUnknown, moment, plusMinus, withUnit } from "./format.js";
import { ageOf, differenceOf, hrefOf, kMarks, kTrace_s, mainOf, makeAxis, modelName, partOfTrace, rateOf, readable, stabilityOf, stabilityText, statusOf, verdictOf } from "./state.js";

const kMaxTiles = 8;
const kWidth = 240, kHeight = 44, kPad = 3, kMaxStep_s = 2.5; // of a spark line

/** Column: [heading, function of an axis' entry that returns the value to sort by]. */
const kColumns = {
  name: ["name", ({ name }) => name],
  state: ["state", ({ status }) => ({ bad: "1 ", care: "2 ", good: "3 " })[status.level] + status.word],
  difference: ["difference, deg/h", ({ difference }) => difference && Math.abs(difference.deg_per_h)],
  rate: ["rate, deg/h", ({ rate }) => rate.deg_per_h],
  stability: ["stability, deg/h", ({ stability }) => stability],
  temperature: ["temperature, °C", ({ row }) => row.mean_temperature_degc],
  model: ["model", ({ axis }) => modelName(axis)],
  since: ["line since, UTC", ({ gyro }) => gyro.status?.state_since_s],
};

const kNumbers = ["difference", "rate", "stability", "temperature"];

/** Path of member `part` of a trace, with a gap at a missing or unknown second; "" for fewer than two values. Exported for its test. */
export function sparkPath(trace, span_s, part = 1) {
  const known = trace.filter((row) => Number.isFinite(row[part])).map((row) => [row[0], row[part]]);
  if (known.length < 2) return "";
  const end_s = trace[trace.length - 1][0], values = known.map(([, value]) => value), low = Math.min(...values), high = Math.max(...values);
  const scale = high > low ? (kHeight - 2 * kPad) / (high - low) : 0;
  return known
    .map(([time_s, value], i) => {
      const x = kWidth * (1 - (end_s - time_s) / span_s), y = scale ? kHeight - kPad - (value - low) * scale : kHeight / 2;
      const isNext = i > 0 && time_s - known[i - 1][0] < kMaxStep_s;
      return `${isNext ? "L" : "M"}${x.toFixed(1)},${y.toFixed(1)}`;
    })
    .join("");
}

/** What tile and row show of an axis. */
function entryOf(gyro, axis, linked, now_ms) {
  const status = statusOf(gyro, axis, linked, now_ms), shown = readable(axis, status.old);
  return { gyro, axis, status, row: shown.window ?? {}, main: mainOf(shown), difference: differenceOf(shown), rate: rateOf(shown), stability: stabilityOf(axis), name: `${gyro.name} ${axis.name}`.trim(),
    age: status.old ? ageOf(axis, now_ms) : "" };
}

/** Orders entries by a column; unknown values are last. Exported for its test. */
export function sorted(entries, column, isDown) {
  const value = kColumns[column][1], unknown = (x) => x === undefined || x === null || Number.isNaN(x);
  const compare = (a, b) => (typeof a === "string" ? a.localeCompare(b, "en", { numeric: true }) : a - b) * (isDown ? -1 : 1);
  return [...entries].sort((one, other) => {
    const [a, b] = [value(one), value(other)];
    return unknown(a) || unknown(b) ? unknown(a) - unknown(b) : compare(a, b);
  });
}

function makeTile({ gyro, axis }) {
  const part = Object.fromEntries(["mark", "word", "count", "label", "big", "sd", "age"].map((name) => [name, el("span", { class: name })]));
  const note = el("p", { class: "note" }), why = el("p", { class: "why" }), line = svg("path", { class: "spark-line", d: "" });
  const pairs = { corrected: "corrected, deg/h", bias: "bias ± sd, deg/h", temperature: "temperature", stability: "stability, deg/h", model: "model", monitor: "monitor" };
  for (const name of Object.keys(pairs)) part[name] = el("dd", { class: `value ${name}` });
  for (const number of [part.big, part.sd]) number.classList.add("value");
  const element = el("a", { class: "tile", href: hrefOf(gyro, axis) },
    el("header", {}, el("h2", {}, gyro.name, el("span", { class: "axis" }, ` ${axis.name}`)), el("span", { class: "verdict" }, part.mark, part.word, part.count)),
    el("p", { class: "rate" }, part.label, part.big, part.sd, el("span", { class: "unit" }, "deg/h"), part.age),
    svg("svg", { class: "spark", viewBox: `0 0 ${kWidth} ${kHeight}`, preserveAspectRatio: "none", "aria-hidden": "true" }, line), note,
    el("dl", {}, ...Object.entries(pairs).map(([name, label]) => el("div", {}, el("dt", {}, label), part[name]))), why);
  let drawn = "";
  return { element, draw({ axis, status, row, main, difference, rate, name, age }) {
    setAttribute(element, "class", `tile ${status.level}${status.old ? " old" : ""}`);
    const texts = { mark: kMarks[status.level], word: status.word, count: status.count ?? "", label: main.what, big: main.text, sd: main.sd, age, model: modelName(axis), monitor: verdictOf(axis) ?? "",
      corrected: difference ? `${rate.text} ${rate.sd}` : "",
      bias: plusMinus(row.bias_deg_per_h, row.sd_deg_per_h), temperature: withUnit(row.mean_temperature_degc, 3, "°C"), stability: stabilityText(axis.stability) };
    for (const [key, text] of Object.entries(texts)) setText(part[key], text);
    for (const key of ["corrected", "monitor"]) part[key].parentElement.hidden = texts[key] === "";
    setText(note, axis.trace.length === 0 ? "" : `${partOfTrace(axis) === 1 ? "corrected" : "raw"}, last 10 min${status.old ? " received" : ""}`);
    setText(why, status.level === "good" ? "" : status.why);
    setAttribute(element, "aria-label", [`${name.replace(/ (?=\S*$)/, " axis ")}: ${status.word}`, status.why, `${main.what} ${main.text} deg/h`, age].filter(Boolean).join(", "));
    const trace = `${partOfTrace(axis)} ${axis.trace.length} ${axis.trace[0]} ${axis.trace.at(-1)}`; // a path has 600 points
    if (trace !== drawn) setAttribute(line, "d", sparkPath(axis.trace, kTrace_s, partOfTrace(axis)));
    drawn = trace;
  } };
}

function makeRow({ gyro, axis, name }) {
  const cells = Object.keys(kColumns).map((key) => el("td", { class: kNumbers.includes(key) ? "value" : key }));
  cells[0] = el("th", { scope: "row" }, el("a", { href: hrefOf(gyro, axis) }, name));
  const element = el("tr", {}, ...cells);
  return { element, draw({ gyro, axis, status, difference, rate, row, stability, age }) {
    setAttribute(element, "class", `${status.level}${status.old ? " old" : ""}`);
    setAttribute(cells[1], "title", [status.why, verdictOf(axis)].filter(Boolean).join("; "));
    const texts = [`${kMarks[status.level]} ${[status.word, status.count, age].filter(Boolean).join(", ")}`, difference ? `${difference.text} ${difference.sd}` : kUnknown, `${rate.text} ${rate.sd}`, fixed(stability, 5),
      fixed(row.mean_temperature_degc, 3), modelName(axis), moment(gyro.status?.state_since_s)];
    texts.forEach((text, i) => setText(cells[i + 1], text));
  } };
}

/** "3 gyros, 5 axes: 4 good, 1 to check". */
function sumUp(gyros, entries) {
  const count = (level) => entries.filter(({ status }) => status.level === level).length, plural = (n, one, many) => `${n} ${n === 1 ? one : many}`;
  const parts = [`${count("good")} good`, count("care") && `${count("care")} caution`, count("bad") && `${count("bad")} to check`];
  return `${plural(gyros.size, "gyro", "gyros")}, ${plural(entries.filter(({ axis }) => axis.name).length, "axis", "axes")}: ${parts.filter(Boolean).join(", ")}`;
}

/** Makes the overview; call draw() after each change. It keeps order and filter of the table. */
export function makeOverview() {
  let column = "name", isDown = false, arranged = "", redraw = () => {};
  const sortBy = (key) => {
    isDown = key === column && !isDown;
    column = key;
    redraw();
  };
  const sum = el("p", { class: "sum", role: "status" }), empty = el("p", { class: "empty", hidden: true }, "No prismd is running on this host.");
  const filter = el("input", { type: "search", size: 28, placeholder: "filter: name, state, model", "aria-label": "filter", input: () => redraw() });
  const heads = Object.entries(kColumns).map(([key, [title]]) => el("th", { scope: "col", class: kNumbers.includes(key) && "number" }, el("button", { type: "button", click: () => sortBy(key) }, title)));
  const tiles = el("div", { class: "tiles" }), body = el("tbody"), table = el("table", {}, el("thead", {}, el("tr", {}, ...heads)), body), parts = new Map();
  const element = el("div", {}, el("h1", { class: "unseen" }, "All gyros"), el("div", { class: "sum-line" }, sum, filter), tiles, table, empty);

  const partOf = (entry, isTable) => {
    const key = `${isTable} ${entry.name}`;
    if (!parts.has(key)) parts.set(key, isTable ? makeRow(entry) : makeTile(entry));
    return parts.get(key);
  };
  /** Shows the entries in their order; the tiles of one gyro are a group. */
  const arrange = (entries, isTable) => {
    const elementsOf = (some) => some.map((entry) => partOf(entry, isTable).element);
    const groups = [...new Set(entries.map(({ gyro }) => gyro))].map((gyro) => el("section", { class: "device", "aria-label": gyro.name }, ...elementsOf(entries.filter((one) => one.gyro === gyro))));
    tiles.replaceChildren(...(isTable ? [] : groups));
    body.replaceChildren(...(isTable ? elementsOf(entries) : []));
    filter.hidden = table.hidden = !isTable;
    heads.forEach((head, i) => setAttribute(head, "aria-sort", Object.keys(kColumns)[i] !== column ? "none" : isDown ? "descending" : "ascending"));
  };
  const draw = (gyros, linked, now_ms) => {
    redraw = () => draw(gyros, linked, now_ms);
    const axesOf = (gyro) => (gyro.axes.size > 0 ? [...gyro.axes.values()] : [makeAxis("")]);
    const entries = [...gyros.values()].flatMap((gyro) => axesOf(gyro).map((axis) => entryOf(gyro, axis, linked, now_ms)));
    const isTable = entries.length > kMaxTiles, wanted = filter.value.toLowerCase(), textOf = (entry) => `${entry.name} ${entry.status.word} ${modelName(entry.axis)}`;
    // a new order only for a reason: rows that move each second cannot be clicked
    const reason = JSON.stringify([column, isDown, wanted, entries.map(({ name, status }) => [name, status.word])]);
    if (reason !== arranged) arrange(isTable ? sorted(entries, column, isDown).filter((entry) => textOf(entry).toLowerCase().includes(wanted)) : entries, isTable);
    arranged = reason;
    for (const entry of entries) partOf(entry, isTable).draw(entry);
    empty.hidden = gyros.size > 0 || !linked;
    setText(sum, linked ? sumUp(gyros, entries) : "Not connected: all values are old.");
  };
  return { element, draw };
}
