// SPDX-License-Identifier: MIT
// The page: one connection, the state that it updates, and one of two views: all gyros or one axis.
import { el, setText } from "./dom.js";
import { clock } from "./charts/format.js";
import { GyroView } from "./gyro.js";
import { makeOverview } from "./overview.js";
import { Socket } from "./socket.js";
import { allGood, axisOf, byAxis, worstLevelOf, kTrace_s, makeGyro, takeEvent, takeInstance, takeStability, takeStatus, takeWindow } from "./state.js";
import { startTheme } from "./theme.js";
import { measured } from "./timing.js";

const kStatus_ms = 2000, kStability_ms = 10000, kDrawDelay_ms = 60, kRetry_ms = 5000;
const find = (id) => document.getElementById(id);
const gyros = new Map(), main = find("main");
let view = null, overview = null, drawTimer, frame, badNames = "", wasBad = false, lastMessage_s = null;

/**
 * Exchanges the one-time token in the address that prismweb printed for a cookie, which scripts cannot read. Neither this page
 * nor the history keeps it.
 */
async function exchangeToken() {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  if (token === null) return;
  history.replaceState(null, "", "#/");
  await fetch("session", { method: "POST", headers: { Authorization: `Bearer ${token}` } }).catch(() => {}); // a rejection is reported by the connection
}

const announce = (text) => setText(find("spoken"), text);
await exchangeToken();
const socket = new Socket(new URL("ws", location.href.replace(/^http/, "ws").replace(/#.*/, "")));
let place = location.hash;

/** Collects changes for a short time, then draws them together. A hidden tab gets no frames, but its title is updated. */
function draw() {
  drawTimer ??= setTimeout(() => {
    drawTimer = undefined;
    updateTitle();
    frame ??= requestAnimationFrame(drawNow);
  }, kDrawDelay_ms);
}

/** Puts the gyros to check into the title, and announces changes to screen readers. */
function updateTitle() {
  const now_ms = performance.now(), bad = [];
  for (const gyro of gyros.values()) if (worstLevelOf(gyro, socket.ready, now_ms) === "bad") bad.push(gyro.name);
  const names = bad.join(", ");
  if (names && names !== badNames) announce(`to check: ${names}`);
  if (names) wasBad = true;
  else if (wasBad && allGood(gyros.values(), socket.ready, now_ms)) {
    wasBad = false;
    announce("all gyros are good");
  }
  badNames = names;
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

/** Sends a request; passes the result to `take`. Returns false if it failed. */
async function request(gyro, method, params, take) {
  let result;
  try {
    result = await socket.call(gyro.name, method, params);
  } catch {
    return false; // if the instance stopped, `instances` reports it
  }
  take(result);
  draw();
  return true;
}

/** Sends a periodic request unless the previous one is pending: an unresponsive instance must not collect requests. */
async function poll(gyro, method, take) {
  if (gyro.polls.has(method)) return;
  gyro.polls.add(method);
  try {
    await request(gyro, method, null, take);
  } finally {
    gyro.polls.delete(method);
  }
}

/** Sends a request once per run of the instance; retries if it fails, while the run lasts and `wanted()` is true. */
async function requestOnce(gyro, method, params, take, wanted = () => true) {
  const run = gyro.run;
  if (await request(gyro, method, params, take)) return;
  const isWanted = () => gyros.get(gyro.name) === gyro && gyro.run === run && gyro.state === "running" && socket.ready && wanted();
  setTimeout(() => { if (isWanted()) requestOnce(gyro, method, params, take, wanted); }, kRetry_ms);
}

const requestStatus = (gyro) => poll(gyro, "status", (status) => {
  takeStatus(gyro, status, performance.now());
  reroute();
});
const requestStability = (gyro) => poll(gyro, "stability", (stability) => takeStability(gyro, stability));
const requestLine = (target) => poll(target.gyro, "line", (line) => target.line.draw(line));
const requestModel = (target) => requestOnce(target.gyro, "model", { axis: target.axis.name }, (result) => { target.model = result.axes[target.axis.name]; }, () => view === target);

/** Requests the state of an instance that has started, and subscribes to its notifications. */
function start(gyro) {
  requestOnce(gyro, "subscribe", { streams: ["window", "event"] }, () => {});
  requestStatus(gyro);
  requestStability(gyro);
  requestOnce(gyro, "history", { seconds: kTrace_s }, (history) => {
    const now_ms = performance.now();
    for (const [name, rows] of byAxis(history)) {
      if (rows.length > 0) axisOf(gyro, name).trace = [];
      for (const row of rows) takeWindow(gyro, row, gyro.axes.get(row.axis)?.window_ms ?? now_ms);
    }
  });
  requestOnce(gyro, "events", null, (events) => { gyro.events.splice(0, gyro.events.length, ...events); });
}

function takeInstances(list) {
  const starting = [];
  for (const gyro of [...gyros.values()]) {
    if (list.some((one) => one.name === gyro.name)) continue;
    if (view?.gyro === gyro) takeInstance(gyro, { state: "gone", axes: [] }); // the gyro on the screen stays
    else gyros.delete(gyro.name);
  }
  for (const one of list) {
    if (!gyros.has(one.name)) gyros.set(one.name, makeGyro(one.name));
    const gyro = gyros.get(one.name), before = gyro.state;
    takeInstance(gyro, one);
    if (one.state === "running" && before !== "running") starting.push(gyro);
  }
  for (const gyro of starting) gyro.run++;
  // first the rows that the user waits for
  if (!reroute() && starting.includes(view?.gyro)) { view.reload(); requestModel(view); requestLine(view); }
  starting.forEach(start);
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
      requestStatus(gyro);
      if (params.kind === "reloaded" && view?.gyro === gyro) requestModel(view);
      if (params.severity !== "info") announce(`${gyro.name}: ${params.text}`);
    }
  }
  draw();
}

/** Decodes a part of the address; returns it unchanged if its escapes are invalid. */
function decoded(part) {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}

/** The target of the address, if it exists: #/GYRO/AXIS one axis, #/GYRO the first axis; null: the overview. */
function addressTarget() {
  const [, name, axisName] = place.split("/").map(decoded), gyro = gyros.get(name);
  const axis = axisName ? gyro?.axes.get(axisName) : gyro?.axes.values().next().value;
  return axis ? { gyro, axis } : null;
}

/** Shows the view that the address names. */
function route() {
  const target = addressTarget();
  view?.destroy();
  view = overview = null;
  main.replaceChildren();
  if (target) {
    const { gyro, axis } = target, href = (one) => `#/${encodeURIComponent(gyro.name)}/${encodeURIComponent(one.name)}`;
    const tabs = [...gyro.axes.values()].map((one) => el("a", { href: href(one), "aria-current": one === axis && "page" }, `${gyro.name} ${one.name}`));
    main.append(el("nav", { class: "trail", "aria-label": "where" }, el("a", { href: "#/" }, "all gyros"), ...tabs));
    view = new GyroView(main, { socket, gyro, axis, announce });
    requestModel(view);
    requestLine(view);
  } else {
    main.append(el("h1", { class: "unseen" }, "All gyros"));
    overview = makeOverview(main);
  }
  draw();
}

/** Changes the view if the target of the address now exists or has been replaced; returns true if it did. */
function reroute() {
  const target = addressTarget();
  if ((view || overview) && target?.axis === view?.axis && target?.gyro === view?.gyro) return false;
  route();
  return true;
}

/** Handles a change of the address by the user: shows the view and focuses it for keys and screen readers. */
function navigate() {
  if (location.hash.includes("token=")) return location.reload();
  if (location.hash && !location.hash.startsWith("#/")) return;
  place = location.hash;
  route();
  main.focus({ preventScroll: true });
  scrollTo(0, 0);
}

/** After a sleep of `ms`, which the steady clock does not count: makes all values that much older. */
function slept({ ms }) {
  for (const gyro of gyros.values()) for (const axis of gyro.axes.values()) axis.window_ms -= ms;
  view?.slept(ms);
}

/** Shows the alarm that the page is not connected, or hides it if the text is empty. */
function showAlarm(text) {
  const alarm = find("alarm");
  alarm.hidden = text === "";
  setText(alarm, text);
  document.body.classList.toggle("cut", text !== "");
  setText(find("link"), text ? "■ not connected" : "● connected");
  draw();
}

socket.addEventListener("ready", ({ detail }) => {
  lastMessage_s = null;
  showAlarm("");
  setText(find("host"), `${detail.host} · prismweb ${detail.version}`);
  for (const gyro of gyros.values()) gyro.state = "";
  takeInstances(detail.instances);
});
socket.addEventListener("cut", ({ detail }) => {
  lastMessage_s ??= detail.received_ms / 1000;
  showAlarm(`No connection to prismweb since ${clock(lastMessage_s)} UTC: ${detail.why}. All values below are old. The page reconnects automatically.`);
});
socket.addEventListener("refused", ({ detail }) => showAlarm(`prismweb rejected this page: ${detail.why}. Reload the page. If that does not help, run "systemctl reload prismweb" and open the new address that it prints.`));
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

/** Calls `act` periodically for each running instance. */
const everyInstance = (period_ms, act) => setInterval(() => [...gyros.values()].filter((gyro) => gyro.state === "running" && socket.ready).forEach(act), period_ms);
everyInstance(kStatus_ms, requestStatus);
everyInstance(kStability_ms, requestStability);
everyInstance(kStatus_ms, (gyro) => { if (view?.gyro === gyro) requestLine(view); });
