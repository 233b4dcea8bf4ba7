// SPDX-License-Identifier: MIT
// The page: one connection, what it tells kept in the state, and one of two views of it: all gyros, or one axis of one.
import { el, setText } from "./dom.js";
import { clock } from "./format.js";
import { GyroView } from "./gyro.js";
import { makeOverview } from "./overview.js";
import { Socket } from "./socket.js";
import { axisOf, byAxis, judgeGyro, kTrace_s, makeGyro, takeEvent, takeInstance, takeStability, takeStatus, takeWindow } from "./state.js";
import { startTheme } from "./theme.js";
import { measured } from "./timing.js";

const kStatus_ms = 2000, kStability_ms = 10000, kGather_ms = 60, kTokenKey = "prism-token";
const find = (id) => document.getElementById(id);
const gyros = new Map(), main = find("main");
let view = null, overview = null, due, worst = "", cut_s = null;

/** The token stands in the fragment once; then this tab keeps it, and the address shows it no more. */
function takeToken() {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  if (token !== null) {
    sessionStorage.setItem(kTokenKey, token);
    history.replaceState(null, "", "#/");
  }
  return sessionStorage.getItem(kTokenKey) ?? "";
}

const say = (text) => setText(find("spoken"), text);
const socket = new Socket(new URL("ws", location.href.replace(/^http/, "ws").replace(/#.*/, "")), takeToken());

/** What is new is drawn together, soon after the first of it came. */
function draw() {
  due ??= setTimeout(() => requestAnimationFrame(drawNow), kGather_ms);
}

function drawNow() {
  const now_ms = performance.now(), bad = [];
  due = undefined;
  overview?.draw(gyros, socket.ready, now_ms);
  view?.update(socket.ready, now_ms);
  setText(find("utc"), `${clock(Date.now() / 1000)} UTC`);
  for (const gyro of gyros.values()) if (judgeGyro(gyro, socket.ready, now_ms) === "bad") bad.push(gyro.name);
  const names = bad.join(", ");
  if (names !== worst) say(names ? `to look at: ${names}` : "all gyros are well");
  worst = names;
  if (document.title !== titleOf(names)) document.title = titleOf(names);
  measured("prism-update", now_ms);
}

const titleOf = (names) => (names ? `■ ${names} – prism` : "prism");

async function ask(gyro, method, params, take) {
  try {
    take(await socket.call(gyro.name, method, params));
    draw();
  } catch (error) {
    gyro.refused = error.message; // said by `instances` where the instance went away
  }
}

const askStatus = (gyro) => ask(gyro, "status", null, (answer) => takeStatus(gyro, answer, performance.now()));
const askStability = (gyro) => ask(gyro, "stability", null, (answer) => takeStability(gyro, answer));
const askLine = (shown) => ask(shown.gyro, "line", null, (answer) => shown.line.draw(answer));
const askModel = (shown) => ask(shown.gyro, "model", { axis: shown.axis.name }, (answer) => { shown.model = answer; });

/** All that is not told by itself, when an instance is there, or is there again. */
function begin(gyro) {
  ask(gyro, "subscribe", { streams: ["window", "event"] }, () => {});
  askStatus(gyro);
  askStability(gyro);
  ask(gyro, "history", { seconds: kTrace_s }, (answer) => {
    const fresh_ms = performance.now();
    for (const rows of Array.isArray(answer) ? [answer] : byAxis(answer).map(([, part]) => part)) {
      if (rows.length > 0) axisOf(gyro, rows[0].axis).trace = [];
      for (const row of rows) takeWindow(gyro, row, gyro.axes.get(row.axis)?.window_ms ?? fresh_ms);
    }
  });
  ask(gyro, "events", null, (answer) => { gyro.events.splice(0, gyro.events.length, ...answer); });
}

function takeInstances(list) {
  const starting = [];
  for (const name of [...gyros.keys()]) if (!list.some((one) => one.name === name)) gyros.delete(name);
  for (const one of list) {
    if (!gyros.has(one.name)) gyros.set(one.name, makeGyro(one.name));
    const gyro = gyros.get(one.name), before = gyro.state;
    takeInstance(gyro, one);
    if (one.state === "running" && before !== "running") starting.push(gyro);
  }
  // the rows that somebody waits for are asked for first
  if (!overview && !view) route();
  else if (starting.includes(view?.gyro)) { view.reload(); askModel(view); askLine(view); }
  starting.forEach(begin);
  draw();
}

function takeBatch({ instance, batch }) {
  const gyro = gyros.get(instance);
  if (!gyro) return;
  const now_ms = performance.now();
  for (const { method, params } of batch) {
    if (method === "window") {
      takeWindow(gyro, params, now_ms);
      if (view?.gyro === gyro && view.axis.name === params.axis) view.window(params);
    } else if (method === "event") {
      takeEvent(gyro, params);
      askStatus(gyro);
      if (params.kind === "reloaded" && view?.gyro === gyro) askModel(view);
      if (params.severity !== "info") say(`${gyro.name}: ${params.text}`);
    }
  }
  draw();
}

/** #/ is the overview, #/GYRO/AXIS one axis. */
function route() {
  const [, name, axis] = location.hash.split("/").map(decodeURIComponent), gyro = gyros.get(name);
  view?.destroy();
  view = overview = null;
  main.replaceChildren();
  if (gyro) {
    const tabs = [...gyro.axes.keys()].map((one) => el("a", { href: `#/${encodeURIComponent(name)}/${encodeURIComponent(one)}`, "aria-current": one === (axis || [...gyro.axes.keys()][0]) && "page" }, `${name} ${one}`));
    main.append(el("nav", { class: "trail", "aria-label": "where" }, el("a", { href: "#/" }, "all gyros"), ...tabs));
    view = new GyroView(main, { socket, gyro, axis: axisOf(gyro, axis || [...gyro.axes.keys()][0] || ""), say });
    askModel(view);
    askLine(view);
  } else {
    main.append(el("h1", { class: "unseen" }, "All gyros"));
    overview = makeOverview(main);
  }
  draw();
}

function cut(text) {
  const alarm = find("alarm");
  alarm.hidden = text === "";
  setText(alarm, text);
  document.body.classList.toggle("cut", text !== "");
  setText(find("link"), text ? "■ not connected" : "● connected");
  draw();
}

socket.addEventListener("ready", ({ detail }) => {
  cut_s = null;
  cut("");
  setText(find("host"), `${detail.host} · prismweb ${detail.version}`);
  for (const gyro of gyros.values()) gyro.state = "";
  takeInstances(detail.instances);
});
socket.addEventListener("cut", ({ detail }) => {
  cut_s ??= Date.now() / 1000;
  cut(`No connection to prismweb since ${clock(cut_s)} UTC: ${detail.why}. Every value below is old. It is tried again by itself.`);
});
socket.addEventListener("refused", ({ detail }) => cut(`prismweb refused this page: ${detail.why || "the token is wrong"}. Open the address that prismweb printed, with its token.`));
socket.addEventListener("instances", ({ detail }) => takeInstances(detail));
socket.addEventListener("batch", ({ detail }) => takeBatch(detail));
socket.addEventListener("lost", ({ detail }) => { if (view?.gyro.name === detail.instance) view.reload(); });
addEventListener("hashchange", () => (location.hash.includes("token=") ? location.reload() : route()));

const nextTheme = startTheme(find("theme"), () => view?.strips.recolour());
find("keys").addEventListener("click", () => find("help").showModal());
addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || find("help").open || event.target.closest("input, select")) return;
  if (view?.key(event)) event.preventDefault();
  else if (event.key === "t" || event.key === "T") nextTheme();
  else if (event.key === "?") find("help").showModal();
  else if (event.key === "Escape" && view) location.hash = "#/";
});
setInterval(draw, 1000);

/** Asks each instance that runs, again and again. */
const often = (period_ms, act) => setInterval(() => [...gyros.values()].filter((gyro) => gyro.state === "running" && socket.ready).forEach(act), period_ms);
often(kStatus_ms, askStatus);
often(kStability_ms, askStability);
often(kStatus_ms, (gyro) => { if (view?.gyro === gyro) askLine(view); });
