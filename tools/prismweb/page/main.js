// SPDX-License-Identifier: MIT
// The page: one connection, what it tells kept in the state, and one of two views of it: all gyros, or one axis of one.
import { el, setText } from "./dom.js";
import { clock } from "./charts/format.js";
import { GyroView } from "./gyro.js";
import { makeOverview } from "./overview.js";
import { Socket } from "./socket.js";
import { allGood, axisOf, byAxis, judgeGyro, kTrace_s, makeGyro, takeEvent, takeInstance, takeStability, takeStatus, takeWindow } from "./state.js";
import { startTheme } from "./theme.js";
import { measured } from "./timing.js";

const kStatus_ms = 2000, kStability_ms = 10000, kGather_ms = 60, kAgain_ms = 5000;
const find = (id) => document.getElementById(id);
const gyros = new Map(), main = find("main");
let view = null, overview = null, due, frame, worst = "", wasBad = false, cut_s = null;

/**
 * The token of an address that prismweb printed is good once: prismweb answers it with a cookie, which no script can read. Neither this page
 * nor the history keeps it.
 */
async function exchangeToken() {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  if (token === null) return;
  history.replaceState(null, "", "#/");
  await fetch("session", { method: "POST", headers: { Authorization: `Bearer ${token}` } }).catch(() => {}); // the connection reports a refusal
}

const say = (text) => setText(find("spoken"), text);
await exchangeToken();
const socket = new Socket(new URL("ws", location.href.replace(/^http/, "ws").replace(/#.*/, "")));
let place = location.hash;

/** What is new is drawn together, soon after the first of it came. A tab that nobody sees has no frames, and a title that somebody does. */
function draw() {
  due ??= setTimeout(() => {
    due = undefined;
    judgeAll();
    frame ??= requestAnimationFrame(drawNow);
  }, kGather_ms);
}

function judgeAll() {
  const now_ms = performance.now(), bad = [];
  for (const gyro of gyros.values()) if (judgeGyro(gyro, socket.ready, now_ms) === "bad") bad.push(gyro.name);
  const names = bad.join(", ");
  if (names && names !== worst) say(`to look at: ${names}`);
  if (names) wasBad = true;
  else if (wasBad && allGood(gyros.values(), socket.ready, now_ms)) {
    wasBad = false;
    say("all gyros are well");
  }
  worst = names;
  if (document.title !== titleOf(names)) document.title = titleOf(names);
}

function drawNow() {
  const now_ms = performance.now();
  frame = undefined;
  overview?.draw(gyros, socket.ready, now_ms);
  view?.update(socket.ready, now_ms);
  setText(find("utc"), `${clock(Date.now() / 1000)} UTC`);
  measured("prism-update", now_ms);
}

const titleOf = (names) => (names ? `■ ${names} – prism` : "prism");

/** Answers whether it was answered. */
async function ask(gyro, method, params, take) {
  let answer;
  try {
    answer = await socket.call(gyro.name, method, params);
  } catch {
    return false; // where the instance went away `instances` says it
  }
  take(answer);
  draw();
  return true;
}

/** What is asked again and again waits for nobody twice: an instance that does not answer would gather questions. */
async function poll(gyro, method, take) {
  if (gyro.polls.has(method)) return;
  gyro.polls.add(method);
  try {
    await ask(gyro, method, null, take);
  } finally {
    gyro.polls.delete(method);
  }
}

/** What is asked once in a run: again where it was refused, as long as that run lasts and somebody wants it. */
async function insist(gyro, method, params, take, wanted = () => true) {
  const run = gyro.run;
  if (await ask(gyro, method, params, take)) return;
  const still = () => gyros.get(gyro.name) === gyro && gyro.run === run && gyro.state === "running" && socket.ready && wanted();
  setTimeout(() => { if (still()) insist(gyro, method, params, take, wanted); }, kAgain_ms);
}

const askStatus = (gyro) => poll(gyro, "status", (answer) => {
  takeStatus(gyro, answer, performance.now());
  reroute();
});
const askStability = (gyro) => poll(gyro, "stability", (answer) => takeStability(gyro, answer));
const askLine = (shown) => poll(shown.gyro, "line", (answer) => shown.line.draw(answer));
const askModel = (shown) => insist(shown.gyro, "model", { axis: shown.axis.name }, (answer) => { shown.model = answer; }, () => view === shown);

/** All that is not told by itself, when an instance is there, or is there again. */
function begin(gyro) {
  insist(gyro, "subscribe", { streams: ["window", "event"] }, () => {});
  askStatus(gyro);
  askStability(gyro);
  insist(gyro, "history", { seconds: kTrace_s }, (answer) => {
    const fresh_ms = performance.now();
    for (const rows of Array.isArray(answer) ? [answer] : byAxis(answer).map(([, part]) => part)) {
      if (rows.length > 0) axisOf(gyro, rows[0].axis).trace = [];
      for (const row of rows) takeWindow(gyro, row, gyro.axes.get(row.axis)?.window_ms ?? fresh_ms);
    }
  });
  insist(gyro, "events", null, (answer) => { gyro.events.splice(0, gyro.events.length, ...answer); });
}

function takeInstances(list) {
  const starting = [];
  for (const gyro of [...gyros.values()]) {
    if (list.some((one) => one.name === gyro.name)) continue;
    if (view?.gyro === gyro) takeInstance(gyro, { state: "gone", axes: [] }); // what somebody looks at does not vanish
    else gyros.delete(gyro.name);
  }
  for (const one of list) {
    if (!gyros.has(one.name)) gyros.set(one.name, makeGyro(one.name));
    const gyro = gyros.get(one.name), before = gyro.state;
    takeInstance(gyro, one);
    if (one.state === "running" && before !== "running") starting.push(gyro);
  }
  for (const gyro of starting) gyro.run++;
  // the rows that somebody waits for are asked for first
  if (!reroute() && starting.includes(view?.gyro)) { view.reload(); askModel(view); askLine(view); }
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

/** A part of the address that somebody mistyped stands for itself. */
function decoded(part) {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}

/** What the address names, where it is there: #/GYRO/AXIS one axis, #/GYRO the first one; null: the overview. */
function named() {
  const [, name, axisName] = place.split("/").map(decoded), gyro = gyros.get(name);
  const axis = axisName ? gyro?.axes.get(axisName) : gyro?.axes.values().next().value;
  return axis ? { gyro, axis } : null;
}

/** Shows what the address names. */
function route() {
  const target = named();
  view?.destroy();
  view = overview = null;
  main.replaceChildren();
  if (target) {
    const { gyro, axis } = target, href = (one) => `#/${encodeURIComponent(gyro.name)}/${encodeURIComponent(one.name)}`;
    const tabs = [...gyro.axes.values()].map((one) => el("a", { href: href(one), "aria-current": one === axis && "page" }, `${gyro.name} ${one.name}`));
    main.append(el("nav", { class: "trail", "aria-label": "where" }, el("a", { href: "#/" }, "all gyros"), ...tabs));
    view = new GyroView(main, { socket, gyro, axis, say });
    askModel(view);
    askLine(view);
  } else {
    main.append(el("h1", { class: "unseen" }, "All gyros"));
    overview = makeOverview(main);
  }
  draw();
}

/** The address may name by now what was not there, or what is another than before; answers whether it does. */
function reroute() {
  const target = named();
  if ((view || overview) && target?.axis === view?.axis && target?.gyro === view?.gyro) return false;
  route();
  return true;
}

/** Somebody went elsewhere: keys and the screen's reader begin there. */
function navigate() {
  if (location.hash.includes("token=")) return location.reload();
  if (location.hash && !location.hash.startsWith("#/")) return;
  place = location.hash;
  route();
  main.focus({ preventScroll: true });
  scrollTo(0, 0);
}

/** What is shown is so much older than the steady clock says. */
function slept({ ms }) {
  for (const gyro of gyros.values()) for (const axis of gyro.axes.values()) axis.window_ms -= ms;
  view?.slept(ms);
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
  cut_s ??= detail.heard_ms / 1000;
  cut(`No connection to prismweb since ${clock(cut_s)} UTC: ${detail.why}. Every value below is old. It is tried again by itself.`);
});
socket.addEventListener("refused", ({ detail }) => cut(`prismweb refused this page: ${detail.why}. Load it again. If that does not help, open an address that prismweb printed and that was not used before: "systemctl reload prismweb" prints a new one.`));
socket.addEventListener("instances", ({ detail }) => takeInstances(detail));
socket.addEventListener("batch", ({ detail }) => takeBatch(detail));
socket.addEventListener("lost", ({ detail }) => { if (view?.gyro.name === detail.instance) view.reload(); });
socket.addEventListener("slept", ({ detail }) => slept(detail));
addEventListener("hashchange", navigate);
document.querySelector(".skip").addEventListener("click", (event) => {
  event.preventDefault(); // the address names a gyro
  main.focus();
});

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
