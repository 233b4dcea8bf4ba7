// SPDX-License-Identifier: MIT
// The one WebSocket: the token first, then JSON-RPC; told at once when it is cut or silent, and opened again by itself.
const kRetryMin_ms = 500, kRetryMax_ms = 5000, kAnswer_ms = 10000, kSilence_ms = 5000, kOpen_ms = 5000;
const kRefused = 1008;

/**
 * Events: "ready" (detail: what the server says of itself), "cut" (detail: {why, retry_ms}), "batch" (detail: {instance,
 * batch}), "instances" and "lost" (detail: their params), "refused" (detail: {why}; it does not try again). call() refuses with an Error where an answer is one.
 */
export class Socket extends EventTarget {
  constructor(url, token) {
    super();
    Object.assign(this, { url, token, retry_ms: kRetryMin_ms, waiting: new Map(), id: 0, ready: false });
    this.open();
    setInterval(() => this.watch(), 1000);
  }

  open() {
    const socket = new WebSocket(this.url);
    Object.assign(this, { socket, ready: false, heard_ms: performance.now(), opened_ms: performance.now() });
    socket.onopen = () => socket.send(JSON.stringify({ token: this.token }));
    socket.onmessage = (message) => this.hear(JSON.parse(message.data));
    socket.onclose = (close) => this.cut(socket, close.reason, close.code === kRefused);
  }

  /** A server that stands still cuts nothing: it is silent, and says so by answering nothing. */
  watch() {
    const now_ms = performance.now();
    const late = this.ready ? now_ms - this.heard_ms > kSilence_ms : now_ms - this.opened_ms > kOpen_ms;
    if (this.socket && late) this.drop("it does not answer");
    for (const [id, request] of this.waiting) {
      if (now_ms - request.asked_ms > kAnswer_ms) this.settle(id, { error: { message: "no answer" } });
    }
  }

  drop(why) {
    const socket = this.socket;
    this.cut(socket, why);
    socket.close();
  }

  hear(message) {
    this.heard_ms = performance.now();
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
    for (const id of [...this.waiting.keys()]) this.settle(id, { error: { message: "the connection is cut" } });
    if (refused) return this.tell("refused", { why });
    this.tell("cut", { why: why || "it is gone", retry_ms: this.retry_ms });
    setTimeout(() => this.open(), this.retry_ms);
    this.retry_ms = Math.min(2 * this.retry_ms, kRetryMax_ms);
  }

  settle(id, answer) {
    const request = this.waiting.get(id);
    if (!request) return;
    this.waiting.delete(id);
    if (answer.error) request.reject(Object.assign(new Error(answer.error.message), { code: answer.error.code }));
    else request.resolve(answer.result);
  }

  /** Asks an instance (null: prismweb itself). */
  call(instance, method, params) {
    if (!this.ready) return Promise.reject(new Error("not connected"));
    const id = ++this.id;
    this.socket.send(JSON.stringify({ jsonrpc: "2.0", id, method, ...(instance && { instance }), ...(params && { params }) }));
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject, asked_ms: performance.now() }));
  }

  tell(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }
}
