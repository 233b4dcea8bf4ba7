// SPDX-License-Identifier: MIT
// The page: one connection, the state that it updates, and one of two views: all gyros or one axis.
import { el, measured, setText } from "./dom.js";
import { clock } from "./format.js";
import { GyroView } from "./gyro.js";
import { makeOverview } from "./overview.js";
import { Socket } from "./socket.js";
import { allGood, axisOf, byAxis, hrefOf, worstLevelOf, kTrace_s, makeGyro, takeEvent, takeInstance, takeParts, takeStatus, takeWindow } from "./state.js";

const kStatus_ms = 2000, kStability_ms = 10000, kDrawDelay_ms = 60;
const find = (id) => document.getElementById(id);
const gyros = new Map(), main = find("main");
const overview = makeOverview();
let view = null, drawTimer, frame, badNames = "", wasBad = false, lastMessage_s = null;

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
  document.title = names ? `■ ${names} – prism` : "prism";
}

function drawNow() {
  const now_ms = performance.now();
  frame = undefined;
  if (view) view.update(socket.ready, now_ms);
  else overview.draw(gyros, socket.ready, now_ms);
  setText(find("utc"), `${clock(Date.now() / 1000)} UTC`);
  measured("prism-update", now_ms);
}

/** Sends a request unless the previous one is pending, because an unresponsive instance must not collect requests. */
async function ask(gyro, method, params, take) {
  if (gyro.pending.has(method)) return;
  gyro.pending.add(method);
  const result = await socket.call(gyro.name, method, params).catch(() => undefined); // if the instance stopped, `instances` reports it
  gyro.pending.delete(method);
  if (result === undefined) return;
  take(result);
  draw();
}

/** Requests that are required once per run of an instance: [params, function of (gyro, result)]. */
const kOnce = {
  subscribe: [{ streams: ["window", "event"] }, () => {}],
  history: [{ seconds: kTrace_s }, (gyro, history) => {
    const now_ms = performance.now();
    for (const [name, rows] of byAxis(history)) {
      if (rows.length > 0) axisOf(gyro, name).trace = [];
      for (const row of rows) takeWindow(gyro, row, gyro.axes.get(row.axis)?.window_ms ?? now_ms);
    }
  }],
  events: [null, (gyro, events) => gyro.events.splice(0, gyro.events.length, ...events)],
};

/** Requests what changes, of the gyro on the screen also its line and models, and what could not be requested yet. */
function requestOften(gyro) {
  const { missing } = gyro, askParts = (method) => ask(gyro, method, null, (result) => takeParts(gyro, method, result));
  ask(gyro, "status", null, (status) => {
    takeStatus(gyro, status, performance.now());
    reroute();
  });
  for (const method of missing) {
    ask(gyro, method, kOnce[method][0], (result) => {
      missing.delete(method);
      kOnce[method][1](gyro, result);
    });
  }
  for (const axis of gyro.axes.values()) {  // without a row since its start, prismd only has those of the log
    if (!gyro.status || axis.window || axis.last_s) continue;
    ask(gyro, "range", { axis: axis.name, seconds: 1, points: 2 }, ({ building, last_s }) => { if (!(building < 1)) axis.last_s = last_s; });
  }
  const isShown = view?.gyro === gyro;
  if (isShown) ask(gyro, "line", null, (line) => view?.line.draw(line));
  if (isShown) askParts("model");
  if (isShown || [...gyro.axes.values()].some(({ quality }) => quality?.includes("input_missing"))) askParts("bias");
}

/** Requests the state of an instance that has started, and subscribes to its notifications. */
function start(gyro) {
  gyro.missing = new Set(Object.keys(kOnce));
  requestStability(gyro);
  requestOften(gyro);
}

const requestStability = (gyro) => ask(gyro, "stability", null, (result) => takeParts(gyro, "stability", result));

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
  // first the rows that the user waits for
  if (!reroute() && starting.includes(view?.gyro)) view.reload();
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
      view?.window(params, instance);
    } else if (method === "event") {
      takeEvent(gyro, params);
      requestOften(gyro);
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
  const [, name, axisName] = place.split("?")[0].split("/").map(decoded), gyro = gyros.get(name);
  const axis = axisName ? gyro?.axes.get(axisName) : gyro?.axes.values().next().value;
  return axis ? { gyro, axis } : null;
}

/** Shows the view that the address names. */
function route() {
  const target = addressTarget();
  view?.destroy();
  view = null;
  main.replaceChildren();
  if (target) showAxis(target.gyro, target.axis, place.split("?")[1] ?? "");
  else main.append(overview.element);
  draw();
}

function showAxis(gyro, axis, query) {
  const tabs = [...gyro.axes.values()].map((one) => [one, el("a", { "aria-current": one === axis && "page" }, `${gyro.name} ${one.name}`)]);
  /** Puts time range and curves into the address, and into those of the other axes. */
  const moved = (now) => {
    for (const [one, tab] of tabs) tab.setAttribute("href", hrefOf(gyro, one) + (now && `?${now}`));
    place = hrefOf(gyro, axis) + (now && `?${now}`);
    if (location.hash !== place) history.replaceState(null, "", place);
  };
  main.append(el("nav", { class: "trail", "aria-label": "where" }, el("a", { href: "#/" }, "all gyros"), ...tabs.map(([, tab]) => tab)));
  view = new GyroView(main, { socket, gyro, axis, gyros, query, moved, announce });
  requestOften(gyro);
}

/** Changes the view if the target of the address now exists or has been replaced; returns true if it did. */
function reroute() {
  const target = addressTarget();
  if (main.firstChild && target?.axis === view?.axis && target?.gyro === view?.gyro) return false;
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
  setText(find("link"), text ? "■ not connected" : "prismweb connected");
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

/** Connects the button of the theme: the system's, light or dark. changed(isPrinted) is called after each change of the theme. Print is light. */
function startTheme(button, changed) {
  const kChoices = ["system", "light", "dark"], kKey = "prism-theme", kLabels = { system: "◐ system", light: "☀ light", dark: "☾ dark" };
  const system = matchMedia("(prefers-color-scheme: dark)");
  let choice = localStorage.getItem(kKey);
  if (!kChoices.includes(choice)) choice = "system";
  const apply = (isPrinted) => {
    const dark = !isPrinted && (choice === "dark" || (choice === "system" && system.matches));
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    button.textContent = kLabels[choice];
    button.setAttribute("aria-label", `theme: ${choice}; press for the next`);
    changed(isPrinted);
  };
  const next = () => {
    choice = kChoices[(kChoices.indexOf(choice) + 1) % kChoices.length];
    localStorage.setItem(kKey, choice);
    apply(false);
  };
  button.addEventListener("click", next);
  system.addEventListener("change", () => apply(false));
  addEventListener("beforeprint", () => apply(true));
  addEventListener("afterprint", () => apply(false));
  apply(false);
  return next;
}

const nextTheme = startTheme(find("theme"), (isPrinted) => view?.strips.restyle(isPrinted));
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
everyInstance(kStatus_ms, requestOften);
everyInstance(kStability_ms, requestStability);
