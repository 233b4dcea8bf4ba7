// SPDX-License-Identifier: MIT
// The page's connection with a fake WebSocket and fake clocks: order of requests, timeouts, sleep of the computer.
import assert from "node:assert/strict";
import { beforeEach, mock, test } from "node:test";

const { Socket } = await import(new URL("../../tools/prismweb/page/socket.js", import.meta.url));
let wall_ms = 1e12, steady_ms = 0, sockets = [], timers = [];
globalThis.CustomEvent ??= class extends Event {
  constructor(name, { detail }) { super(name); this.detail = detail; }
};
mock.method(Date, "now", () => wall_ms);
mock.method(performance, "now", () => steady_ms);
mock.method(globalThis, "setInterval", (act) => timers.push(act));
mock.method(globalThis, "setTimeout", () => {});
globalThis.WebSocket = class {
  constructor() { this.sent = []; sockets.push(this); }
  send(text) { this.sent.push(JSON.parse(text)); }
  close() {}
};

let socket, said;
const tell = (message) => sockets.at(-1).onmessage({ data: JSON.stringify(message) });
const sent = () => sockets.at(-1).sent.filter((one) => one.method).map((one) => `${one.instance ?? "-"} ${one.method}`);
const answer = (index, body = { result: 1 }) => tell({ id: sockets.at(-1).sent.filter((one) => one.method)[index].id, ...body });
const settled = () => new Promise((resolve) => setImmediate(resolve));
function pass(seconds, awake = true) {
  for (let i = 0; i < seconds; i++) {
    wall_ms += 1000;
    if (awake) steady_ms += 1000;
    timers.at(-1)();
  }
}

beforeEach(() => {
  [sockets, timers, said] = [[], [], []];
  socket = new Socket("ws://x/ws");
  for (const name of ["cut", "slept"]) socket.addEventListener(name, ({ detail }) => said.push([name, detail]));
  tell({ ready: true });
});

test("an instance gets two requests at a time, and one that does not respond delays no other", async () => {
  const answers = ["a", "b", "c"].map((method) => socket.call("g", method));
  socket.call("h", "a");
  assert.deepEqual(sent(), ["g a", "g b", "h a"]);
  answer(0);
  assert.equal(await answers[0], 1);
  assert.deepEqual(sent(), ["g a", "g b", "h a", "g c"]);
  answer(1, { error: { code: -32003, message: "it is gone" } });
  await assert.rejects(answers[1], /it is gone/);
});

test("24 requests are pending; requests for rows go first, and requests to prismweb itself do not wait", () => {
  for (let i = 0; i < 30; i++) socket.call(`g${i}`, "status");
  socket.call("g29", "range");
  assert.equal(sent().length, 24);
  socket.call(null, "instances");
  assert.equal(sent().at(-1), "- instances");
  answer(0);
  assert.equal(sent().length, 25, "25 requests were pending");
  answer(1);
  assert.equal(sent().at(-1), "g29 range");
});

test("the timeout of 16 s begins when a request is sent", async () => {
  const answers = ["a", "b", "c"].map((method) => socket.call("g", method).catch((error) => error.message));
  for (let s = 0; s < 17; s++) { pass(1); tell({ batch: [] }); }
  assert.deepEqual(await Promise.all(answers.slice(0, 2)), ["no response", "no response"]);
  assert.deepEqual(sent(), ["g a", "g b", "g c"]);
  for (let s = 0; s < 15; s++) { pass(1); tell({ batch: [] }); }
  answer(2);
  assert.equal(await answers[2], 1);
});

test("the page probes a server without messages, with one request at a time, and disconnects if it does not respond", async () => {
  for (let s = 0; s < 12; s++) {
    pass(1);
    if (s === 2) assert.deepEqual(sent(), ["- instances"]);
    if (s % 3 === 2) answer(sent().length - 1, { error: { message: "no such method" } });
    await settled();
  }
  assert.deepEqual([said, sent().length], [[], 4]);
  const received_ms = wall_ms;
  const queued = ["a", "b", "c"].map((method) => socket.call("g", method).catch((error) => error.message));
  pass(6);
  assert.deepEqual(said, [["cut", { why: "prismweb does not respond", received_ms }]]);
  assert.deepEqual(await Promise.all(queued), Array(3).fill("not connected"));
});

test("a hidden tab checks once a minute, and does not disconnect before it has sent a request", async () => {
  for (let minute = 0; minute < 3; minute++) {
    wall_ms += 60000;
    steady_ms += 60000;
    timers.at(-1)();
    answer(minute);
    await settled();
  }
  assert.deepEqual([said, sent().length], [[], 3]);
});

test("after the computer slept, the page reports it and the time of the last message", () => {
  pass(1);
  tell({ batch: [] });
  const received_ms = wall_ms;
  wall_ms += 8 * 3600 * 1000;
  pass(1);
  assert.deepEqual(said, [["slept", { ms: 8 * 3600 * 1000 }], ["cut", { why: "this computer was asleep", received_ms }]]);
});
