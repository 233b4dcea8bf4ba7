#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Plays prismweb's side of docs/page.md with made-up, SIMULATED gyros, for what a real one cannot play within a test: thirty days of
rows, an hour of them at once, a name that is markup, a server that stands still.

usage: stand_in.py PORT (0: a free one) [--gyros N] [--name TEXT] [--days N] [--speed N]; commands on standard input: gone NAME,
back NAME, leave NAME (it is on the list no more), silent NAME (of its line), freeze, go, building SHARE (0 to 1, of the long view), disk hangs, disk answers,
shift SECONDS (of the data's time, from now on), range delay SECONDS, refuse METHOD... (from now on; none: answer all)
"""
import argparse
import asyncio
import contextlib
import json
import math
import os
import random
import sys
import time

from aiohttp import WSMsgType, web

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
PAGE = os.path.join(ROOT, "tools", "prismweb", "page")
POLICY = "default-src 'self'; frame-ancestors 'none'"
STEPS = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 10800, 21600, 43200, 86400]
COLUMNS = ["time_s"] + [f"{name}_{part}" for name in ("rate", "corrected", "bias") for part in ("min", "max")] + ["sd_max"] + [
    f"{name}_{part}" for name in ("temperature", "slope", "uhfo") for part in ("min", "max")] + [
    "samples", "missing", "seconds", "good", "rate_mean", "corrected_mean"]

NOISE = [random.Random(seed).gauss(0, 1) for seed in range(9973)]


class Gyro:
    """What one simulated gyro measures is a function of time, so that history and live rows agree."""

    def __init__(self, name, model_name, days, axes):
        self.name, self.model_name, self.axes, self.state = name, model_name, axes, "running"
        self.shift_s = 0
        self.silent_since_s = None
        self.first_s = time.time() - days * 86400
        self.events = [{"time_s": time.time() - 900, "severity": "info", "kind": "note", "text": "SIMULATED: made up by a test"},
                       {"time_s": time.time() - 300, "severity": "warning", "kind": "quality", "text": "quality is now extrapolating"},
                       {"time_s": time.time() - 200, "severity": "error", "kind": "line_lost", "text": f"{name}: line lost <b>for a moment</b>"}]

    def now(self):
        """By the data's own clock."""
        return time.time() + self.shift_s

    def truth(self, axis, time_s, span_s=0):
        """Means over the second, or at a long step the drift alone."""
        at = int(time_s) * 7 + self.axes.index(axis) * 1009
        degc = 25 + 12 * math.sin(2 * math.pi * time_s / 20000) + 3 * math.sin(2 * math.pi * time_s / 86400)
        slope = 12 * 2 * math.pi / 20000 * math.cos(2 * math.pi * time_s / 20000)
        bias = 0.02 * math.sin(2 * math.pi * time_s / 20000 + self.axes.index(axis)) + 3 * slope
        rate = 8.465 + bias + 0.06 * NOISE[at % len(NOISE)]
        return {"rate": rate, "bias": bias, "corrected": rate - bias, "sd": 0.004, "temperature": degc, "slope": slope,
                "uhfo": 5.35 + 0.002 * degc + 0.0005 * NOISE[(at + 3) % len(NOISE)]}

    def window(self, axis, time_s):
        t = self.truth(axis, time_s)
        return {"axis": axis, "time_s": time_s, "samples": 200, "missing": 1 if int(time_s) % 97 == 0 else 0, "rate_deg_per_h": round(t["rate"], 6),
                "temperature_degc": round(t["temperature"], 5), "uhfo_v": round(t["uhfo"], 6),
                "mean_rate_deg_per_h": round(8.465 + t["bias"], 6), "mean_temperature_degc": round(t["temperature"], 5),
                "slope_degc_per_s": round(t["slope"], 8), "mean_uhfo_v": round(t["uhfo"], 6), "corrected_mean_deg_per_h": round(8.465 + (t["corrected"] - 8.465) / 10, 6),
                "bias_deg_per_h": round(t["bias"], 6), "sd_deg_per_h": t["sd"], "sd_mean_deg_per_h": t["sd"] * 2,
                "corrected_deg_per_h": round(t["corrected"], 6), "quality": self.quality(axis)}

    def quality(self, axis):
        return "good" if self.axes.index(axis) == 0 else "good" if self.axes.index(axis) == 1 else "extrapolating"

    def model(self, axis):
        return {"id": "5" * 64, "kind": "composite", "name": self.model_name, "sd": "run", "axis": axis, "inputs": ["T", "dTdt", "U"],
                "window": {"length_s": 100}, "domain": {"min": [12, -0.0045, 5.37], "max": [40.0, 0.0045, 5.44]}, "provenance": {"note": "SIMULATED"}}

    def status(self):
        parts = {axis: {"axis": axis, "model": self.model(axis), "quality": self.quality(axis), "window": self.window(axis, int(self.now()) - 1),
                        "window_s": 100, "warm_s": 110, "full_s": 110} for axis in self.axes}
        whole = {"name": self.name, "version": "0", "state": "receiving", "detail": "", "age_s": 0.01, **self.silence(), "gyro_serial": "SIMULATED",
                 "line": {"frames": int((time.time() - self.first_s) * 200), "bad_check": 2, "bad_length": 0, "bad_body": 0}, "timing": {"missing_frames": 3}}
        return {**whole, **parts[self.axes[0]]} if len(self.axes) == 1 else {**whole, "axes": parts}

    def silence(self):
        """Of a status, where its line brings nothing."""
        return {} if self.silent_since_s is None else {"state": "silent", "detail": "", "age_s": time.time() - self.silent_since_s}

    def line(self):
        return {"device": "/dev/simulated", "baud": 921600, "decoder": {"frames": 1000, "bad_check": 2, "bad_length": 0, "bad_body": 0, "skipped_bytes": 40,
                "resyncs": 1, "timeouts": 0}, "timing": {"missing_frames": 3, "duplicates": 0, "resets": 0, "period_s": 0.00500001},
                "nominal_period_s": 0.005, "hardware": None, "notes": ["SIMULATED"]}

    def range(self, axis, from_s, to_s, points):
        last_s = int(self.now()) - 1
        from_s, to_s = max(from_s, self.first_s), min(to_s, last_s)
        step = next((s for s in STEPS if (to_s - from_s) / s <= points), STEPS[-1])
        rows = []
        for end in range(int(from_s // step + 1) * step, int(to_s // step + 1) * step + (step > 1) * step, step):
            t = self.truth(axis, end)
            wide = 0.06 * min(3.5, math.sqrt(2 * math.log(step))) if step > 1 else 0
            row = [end]
            for name in ("rate", "corrected", "bias"):
                half = wide if name != "bias" else 0
                row += [t[name] - half, t[name] + half]
            row += [t["sd"]] + [value for name in ("temperature", "slope", "uhfo") for value in (t[name], t[name])]
            small = (t["rate"] - 8.465 - t["bias"]) / math.sqrt(step)
            rows.append(row + [200 * step, 0, step, step, 8.465 + t["bias"] + small, 8.465 + small])
        return {"axis": axis, "from_s": from_s, "to_s": to_s, "step_s": step, "source": "seconds", "columns": COLUMNS, "rows": rows,
                "first_s": self.first_s, "last_s": last_s}

    def answer(self, method, params):
        axis = params.get("axis") or self.axes[0]
        if method == "range":
            return self.range(axis, params["from_s"], params["to_s"], params["points"])
        now = int(self.now())
        of = {"status": self.status, "events": lambda: self.events, "model": lambda: self.model(axis), "subscribe": lambda: {"window": True},
              "line": self.line, "stability": lambda: {name: {"axis": name, "all": {"sd_deg_per_h": 0.0071}, "raw": {"sd_deg_per_h": 0.01552}, "corrected": {"sd_deg_per_h": 0.00677},
                                           "improvement": 0.56} for name in self.axes},
              "history": lambda: {name: [self.window(name, t) for t in range(now - params.get("seconds", 100), now)] for name in self.axes}}
        found = of[method]()
        return next(iter(found.values())) if method in ("stability", "history") and len(self.axes) == 1 else found


class Server:
    def __init__(self, gyros):
        self.gyros, self.clients, self.frozen, self.building, self.disk = gyros, set(), False, 1, "answers"
        self.delay_s, self.tasks, self.refused = 0, set(), []

    def instances(self):
        return [{"name": gyro.name, "state": gyro.state, "axes": gyro.axes} for gyro in self.gyros if gyro.state != "left"]

    async def socket(self, request):
        ws = web.WebSocketResponse(max_msg_size=65536)
        await ws.prepare(request)
        await ws.receive()
        if request.cookies.get("prism-stand-in") != "session":
            await ws.close(code=1008, message=b"it has no token")
            return ws
        await ws.send_json({"ready": True, "host": "stand-in (SIMULATED)", "version": "0", "instances": self.instances()})
        self.clients.add(ws)
        async for message in ws:
            if message.type == WSMsgType.TEXT and not self.frozen:
                await self.hear(ws, json.loads(message.data))
        self.clients.discard(ws)
        return ws

    async def hear(self, ws, asked):
        """An answer has what there is when it is given, not when it was asked for."""
        if asked["method"] != "range" or not self.delay_s:
            return await self.send(ws, self.reply(asked))
        task = asyncio.create_task(self.later(ws, asked))
        self.tasks.add(task)
        task.add_done_callback(self.tasks.discard)

    async def later(self, ws, asked):
        await asyncio.sleep(self.delay_s)
        await self.send(ws, self.reply(asked))

    def reply(self, asked):
        if asked["method"] == "instances":
            return {"jsonrpc": "2.0", "id": asked["id"], "result": self.instances()}
        gyro = next((gyro for gyro in self.gyros if gyro.name == asked.get("instance")), None)
        head = {"jsonrpc": "2.0", "id": asked["id"], "instance": asked.get("instance")}
        if gyro is None or gyro.state != "running":
            return {**head, "error": {"code": -32003, "message": "the instance does not run"}}
        if asked["method"] in self.refused:
            return {**head, "error": {"code": -32003, "message": "so many questions wait that this one is not taken"}}
        if asked["method"] == "range" and self.disk == "hangs":
            return {**head, "error": {"code": -32000, "message": "the disk has not answered for 5 s"}}
        result = gyro.answer(asked["method"], asked.get("params") or {})
        return {**head, "result": {**result, "building": self.building} if asked["method"] == "range" else result}

    async def live(self, speed):
        """Each second's rows; at another speed so many seconds' in one."""
        time_s = int(time.time())
        while True:
            await asyncio.sleep(1 / speed - time.time() % (1 / speed))
            time_s += 1
            for gyro in self.gyros:
                if gyro.state == "running" and not self.frozen and gyro.silent_since_s is None:
                    await self.tell({"instance": gyro.name, "batch": [{"jsonrpc": "2.0", "method": "window", "params": gyro.window(axis, time_s - 1 + gyro.shift_s)} for axis in gyro.axes]})

    async def tell(self, message):
        for ws in list(self.clients):
            await self.send(ws, message)

    @staticmethod
    async def send(ws, message):
        with contextlib.suppress(ConnectionResetError):  # it went away meanwhile
            await ws.send_json(message)

    async def commands(self):
        reader = asyncio.StreamReader()
        await asyncio.get_running_loop().connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
        while line := (await reader.readline()).decode().split():
            self.frozen = line[0] == "freeze"
            self.building = float(line[1]) if line[0] == "building" else self.building
            self.disk = line[1] if line[0] == "disk" else self.disk
            self.refused = line[1:] if line[0] == "refuse" else self.refused
            self.delay_s = float(line[2]) if line[0] == "range" else self.delay_s
            for gyro in self.gyros:
                gyro.shift_s += int(line[1]) if line[0] == "shift" else 0
                if len(line) > 1 and gyro.name == line[1]:
                    gyro.state = {"gone": "gone", "stopped": "stopped", "leave": "left"}.get(line[0], "running")
                    gyro.silent_since_s = time.time() - 7200 if line[0] == "silent" else None
            await self.tell({"jsonrpc": "2.0", "method": "instances", "params": self.instances()})


async def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("port", type=int)
    parser.add_argument("--gyros", type=int, default=3)
    parser.add_argument("--name", default="composite kernel")
    parser.add_argument("--days", type=float, default=31)
    parser.add_argument("--speed", type=float, default=1)
    options = parser.parse_args()
    server = Server([Gyro(f"gyro{i + 1}", options.name, options.days, ["z"] if i != 1 else ["x", "y", "z"]) for i in range(options.gyros)])

    async def guard(request, response):
        response.headers["Content-Security-Policy"] = POLICY
        response.headers["Cache-Control"] = "no-cache"

    app = web.Application()
    app.on_response_prepare.append(guard)

    async def index(request):
        return web.FileResponse(os.path.join(PAGE, "index.html"))

    async def session(request):
        """The token is good as often as a test opens the address: prismweb's own is good once (tests/system/290-web-address.sh)."""
        if request.headers.get("Authorization") != "Bearer secret":
            return web.Response(status=401)
        response = web.Response(status=204)
        response.set_cookie("prism-stand-in", "session", httponly=True, samesite="Strict")
        return response

    app.router.add_get("/", index)
    app.router.add_post("/session", session)
    app.router.add_get("/ws", server.socket)
    app.router.add_static("/dygraphs", "/usr/share/javascript/dygraphs", follow_symlinks=True)
    app.router.add_static("/", PAGE, follow_symlinks=True)
    runner = web.AppRunner(app)
    await runner.setup()
    await web.TCPSite(runner, "127.0.0.1", options.port).start()
    print(f"http://127.0.0.1:{runner.addresses[0][1]}/#token=secret", flush=True)
    commands = asyncio.create_task(server.commands())
    await server.live(options.speed)
    await commands


asyncio.run(main())
