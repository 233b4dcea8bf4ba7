// SPDX-License-Identifier: MIT
// The WebSocket of the page. The first message is empty, because a cookie or password authenticates the page; then JSON-RPC. Detects a lost
// or unresponsive connection and reconnects automatically.
const kRetryMin_ms = 500, kRetryMax_ms = 5000, kReceiveTimeout_ms = 5000, kProbeAfter_ms = 2000, kConnectTimeout_ms = 5000, kMinSleep_ms = 3000;
const kResponseTimeout_ms = 16000; // prismweb reports an unresponsive prismd after 15 s
const kMaxPending = 24, kMaxPerInstance = 2; // prismweb accepts 32 pending requests of a client, and sends one at a time to an instance
const kPolicyViolation = 1008; // close code of a rejected client

/**
 * Events: "ready" (detail: the server's first message), "cut" (disconnected; detail: {why, received_ms: wall time of the last message}),
 * "slept" (detail: {ms}), "batch" (detail: {instance, batch}), "instances" and "lost" (detail: their params), "refused" (detail: {why}; no
 * reconnection follows). The promise of call() is rejected with an Error for an error response.
 */
export class Socket extends EventTarget {
  constructor(url) {
    super();
    Object.assign(this, { url, retry_ms: kRetryMin_ms, pending: new Map(), queue: [], id: 0, ready: false, received_wall_ms: Date.now() });
    Object.assign(this, { wall_ms: Date.now(), watched_ms: performance.now() });
    this.open();
    setInterval(() => this.watch(), 1000);
  }

  open() {
    const socket = new WebSocket(this.url);
    Object.assign(this, { socket, ready: false, received_ms: performance.now(), opened_ms: performance.now() });
    socket.onopen = () => socket.send("{}");
    socket.onmessage = (message) => this.onMessage(JSON.parse(message.data));
    socket.onclose = (close) => this.cut(socket, close.reason, close.code === kPolicyViolation);
  }

  /** Called once a second. A blocked server does not close the connection, so this probes a server that sends no messages. */
  watch() {
    this.detectSleep();
    const now_ms = performance.now(), quiet_ms = now_ms - this.received_ms;
    // the time without a message is not sufficient: in a hidden tab this runs only once a minute
    const unanswered = now_ms - this.probed_ms >= kReceiveTimeout_ms - kProbeAfter_ms;
    const late = this.ready ? quiet_ms > kReceiveTimeout_ms && unanswered : now_ms - this.opened_ms > kConnectTimeout_ms;
    if (this.socket && late) this.drop("prismweb does not respond");
    else if (this.ready && quiet_ms > kProbeAfter_ms) this.probe();
    for (const [id, request] of this.pending) {
      if (now_ms - request.sent_ms > kResponseTimeout_ms) this.settle(id, { error: { message: "no response" } });
    }
  }

  /** Sends a request; any response shows that the server runs, also an error. One at a time. */
  async probe() {
    if (this.probed_ms !== undefined) return;
    this.probed_ms = performance.now();
    await this.call(null, "instances").catch(() => {});
    this.probed_ms = undefined;
  }

  /** Detects a sleep of the computer: performance.now() stops during it, and the connection is lost without a close event. */
  detectSleep() {
    const wall_ms = Date.now(), now_ms = performance.now(), slept_ms = wall_ms - this.wall_ms - (now_ms - this.watched_ms);
    Object.assign(this, { wall_ms, watched_ms: now_ms });
    if (!(slept_ms > kMinSleep_ms)) return;
    this.emit("slept", { ms: slept_ms });
    if (this.socket) this.drop("this computer was asleep");
  }

  drop(why) {
    const socket = this.socket;
    this.cut(socket, why);
    socket.close();
  }

  onMessage(message) {
    this.received_ms = performance.now();
    this.received_wall_ms = Date.now();
    if (message.ready) {
      this.ready = true;
      this.retry_ms = kRetryMin_ms;
      this.emit("ready", message);
    } else if (message.batch) {
      this.emit("batch", message);
    } else if (message.id !== undefined && message.id !== null) {
      this.settle(message.id, message);
    } else if (message.method) {
      this.emit(message.method, message.params);
    }
  }

  cut(socket, why, refused) {
    if (socket !== this.socket) return;
    this.socket = null;
    this.ready = false;
    const requests = [...this.pending.values(), ...this.queue.splice(0)];
    this.pending.clear();
    for (const request of requests) request.reject(new Error("not connected"));
    if (refused) return this.emit("refused", { why });
    this.emit("cut", { why: why || "connection closed", received_ms: this.received_wall_ms });
    setTimeout(() => this.open(), this.retry_ms);
    this.retry_ms = Math.min(2 * this.retry_ms, kRetryMax_ms);
  }

  settle(id, response) {
    const request = this.pending.get(id);
    if (!request) return;
    this.pending.delete(id);
    if (response.error) request.reject(Object.assign(new Error(response.error.message), { code: response.error.code }));
    else request.resolve(response.result);
    this.sendNext();
  }

  /** Sends a request to an instance, or with null to prismweb itself, without a queue. Requests for rows of charts go first. */
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
    this.pending.set(id, Object.assign(request, { sent_ms: performance.now() }));
    this.socket.send(JSON.stringify({ jsonrpc: "2.0", id, method, protocol: 2, ...(instance && { instance }), ...(params && { params }) }));
  }

  /** Sends queued requests up to the limits. An unresponsive instance delays only its own requests. */
  sendNext() {
    if (!this.ready) return;
    const perInstance = new Map();
    for (const { instance } of this.pending.values()) perInstance.set(instance, (perInstance.get(instance) ?? 0) + 1);
    for (let i = 0; i < this.queue.length && this.pending.size < kMaxPending; ) {
      const { instance } = this.queue[i], count = perInstance.get(instance) ?? 0;
      if (count >= kMaxPerInstance) { i++; continue; }
      perInstance.set(instance, count + 1);
      this.send(this.queue.splice(i, 1)[0]);
    }
  }

  emit(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }
}
