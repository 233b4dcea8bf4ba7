// SPDX-License-Identifier: MIT
// The one WebSocket: an empty message first, as a cookie or password shows who it is, then JSON-RPC; told at once when it is cut or silent, and opened again by itself.
const kRetryMin_ms = 500, kRetryMax_ms = 5000, kSilence_ms = 5000, kQuiet_ms = 2000, kOpen_ms = 5000, kSlept_ms = 3000;
const kAnswer_ms = 16000; // prismweb says itself after 15 s that a prismd did not answer
const kUnderWay = 24, kOfOne = 2; // prismweb takes 32 requests of a client at once, and asks an instance one after the other
const kRefused = 1008;

/**
 * Events: "ready" (detail: what the server says of itself), "cut" (detail: {why, heard_ms: when it was heard last, by the wall's clock}),
 * "slept" (detail: {ms}), "batch" (detail: {instance, batch}), "instances" and "lost" (detail: their params), "refused" (detail: {why}; it does
 * not try again). call() refuses with an Error where an answer is one.
 */
export class Socket extends EventTarget {
  constructor(url) {
    super();
    Object.assign(this, { url, retry_ms: kRetryMin_ms, waiting: new Map(), queue: [], id: 0, ready: false, heard_at_ms: Date.now() });
    Object.assign(this, { wall_ms: Date.now(), watched_ms: performance.now() });
    this.open();
    setInterval(() => this.watch(), 1000);
  }

  open() {
    const socket = new WebSocket(this.url);
    Object.assign(this, { socket, ready: false, heard_ms: performance.now(), opened_ms: performance.now() });
    socket.onopen = () => socket.send("{}");
    socket.onmessage = (message) => this.hear(JSON.parse(message.data));
    socket.onclose = (close) => this.cut(socket, close.reason, close.code === kRefused);
  }

  /** A server that stands still cuts nothing: it is silent, and answers nothing. One that has nothing to tell is asked something. */
  watch() {
    this.wake();
    const now_ms = performance.now(), quiet_ms = now_ms - this.heard_ms;
    // a tab that nobody sees comes here once a minute: how long it heard nothing alone says nothing
    const unanswered = now_ms - this.listens_ms >= kSilence_ms - kQuiet_ms;
    const late = this.ready ? quiet_ms > kSilence_ms && unanswered : now_ms - this.opened_ms > kOpen_ms;
    if (this.socket && late) this.drop("prismweb does not answer");
    else if (this.ready && quiet_ms > kQuiet_ms) this.listen();
    for (const [id, request] of this.waiting) {
      if (now_ms - request.sent_ms > kAnswer_ms) this.settle(id, { error: { message: "no answer" } });
    }
  }

  /** Any answer is life, also a refusal. One at a time. */
  async listen() {
    if (this.listens_ms !== undefined) return;
    this.listens_ms = performance.now();
    await this.call(null, "instances").catch(() => {});
    this.listens_ms = undefined;
  }

  /** While a computer sleeps performance.now() stands still, and the connection is dead without a word. */
  wake() {
    const wall_ms = Date.now(), now_ms = performance.now(), slept_ms = wall_ms - this.wall_ms - (now_ms - this.watched_ms);
    Object.assign(this, { wall_ms, watched_ms: now_ms });
    if (!(slept_ms > kSlept_ms)) return;
    this.tell("slept", { ms: slept_ms });
    if (this.socket) this.drop("this computer was asleep");
  }

  drop(why) {
    const socket = this.socket;
    this.cut(socket, why);
    socket.close();
  }

  hear(message) {
    this.heard_ms = performance.now();
    this.heard_at_ms = Date.now();
    if (message.ready) {
      this.ready = true;
      this.retry_ms = kRetryMin_ms;
      this.tell("ready", message);
    } else if (message.batch) {
      this.tell("batch", message);
    } else if (message.id !== undefined && message.id !== null) {
      this.settle(message.id, message);
    } else if (message.method) {
      this.tell(message.method, message.params);
    }
  }

  cut(socket, why, refused) {
    if (socket !== this.socket) return;
    this.socket = null;
    this.ready = false;
    const requests = [...this.waiting.values(), ...this.queue.splice(0)];
    this.waiting.clear();
    for (const request of requests) request.reject(new Error("not connected"));
    if (refused) return this.tell("refused", { why });
    this.tell("cut", { why: why || "it is gone", heard_ms: this.heard_at_ms });
    setTimeout(() => this.open(), this.retry_ms);
    this.retry_ms = Math.min(2 * this.retry_ms, kRetryMax_ms);
  }

  settle(id, answer) {
    const request = this.waiting.get(id);
    if (!request) return;
    this.waiting.delete(id);
    if (answer.error) request.reject(Object.assign(new Error(answer.error.message), { code: answer.error.code }));
    else request.resolve(answer.result);
    this.sendNext();
  }

  /** Asks an instance (null: prismweb itself, which is not waited for in the queue). What somebody looks at goes before the rest. */
  call(instance, method, params) {
    if (!this.ready) return Promise.reject(new Error("not connected"));
    return new Promise((resolve, reject) => {
      const request = { instance, method, params, resolve, reject };
      if (instance === null) return this.send(request);
      if (method === "range") this.queue.unshift(request);
      else this.queue.push(request);
      this.sendNext();
    });
  }

  send(request) {
    const { instance, method, params } = request, id = ++this.id;
    this.waiting.set(id, Object.assign(request, { sent_ms: performance.now() }));
    this.socket.send(JSON.stringify({ jsonrpc: "2.0", id, method, ...(instance && { instance }), ...(params && { params }) }));
  }

  /** Sends of the queue what there is room for; an instance that does not answer holds up itself alone. */
  sendNext() {
    if (!this.ready) return;
    const asked = new Map();
    for (const { instance } of this.waiting.values()) asked.set(instance, (asked.get(instance) ?? 0) + 1);
    for (let i = 0; i < this.queue.length && this.waiting.size < kUnderWay; ) {
      const { instance } = this.queue[i], count = asked.get(instance) ?? 0;
      if (count >= kOfOne) { i++; continue; }
      asked.set(instance, count + 1);
      this.send(this.queue.splice(i, 1)[0]);
    }
  }

  tell(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }
}
