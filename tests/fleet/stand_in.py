#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Fake servers of N gyros: sockets that respond to status, subscribe, events and rows like prismd (docs/protocol.md), with generated
# rows. usage: stand_in.py DIRECTORY N [--backlog ROWS]
# Each gyro starts with ROWS rows and gets one more per second. Runs until a signal ends it.
import argparse
import asyncio
import json
import os
import time
import uuid

COLUMNS = ("time_utc,time_s,samples,missing,rate_deg_per_h,temperature_degc,uhfo_v,status,mean_rate_deg_per_h,mean_temperature_degc,"
           "slope_degc_per_s,mean_uhfo_v,bias_deg_per_h,sd_deg_per_h,corrected_deg_per_h,corrected_mean_deg_per_h,quality,"
           "sd_mean_deg_per_h,arrival_s,sent_deg_per_h,offset_deg_per_h,partial")
PAGE_BYTES = 256 << 10


class Gyro:
    def __init__(self, name, backlog):
        self.name, self.log = name, uuid.uuid4().hex
        self.begin = int(time.time()) - backlog  # second of the first row
        self.phase = hash(name) % 1000 / 1000
        self.stored = [self.row(i) for i in range(backlog)]  # made before the measurement, which is of relay and database

    def rows(self):
        """Returns the current number of rows; a row exists when its second is over, at the gyro's phase."""
        return max(0, int(time.time() - self.phase) - self.begin)

    def row(self, i):
        t = self.begin + i
        utc = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(t))
        return (f"{utc},{t},200,0,{8.4 + i % 97 / 1000:.6f},25.01310,5.251000,0,8.465252,25.01250,0.00001000,5.250500,"
                f"-0.000125,0.008400,{8.5 + i % 97 / 1000:.6f},8.465377,good,0.009100,{t + self.phase:.3f},,,0")

    async def page(self, params):
        after = params.get("after", "earliest")
        behind = 0 if after == "earliest" else int(after.split("-")[2])
        until = time.monotonic() + params.get("wait_s", 0)
        while self.rows() <= behind and time.monotonic() < until:
            await asyncio.sleep(min(1.0, max(0.005, self.begin + behind + 1 + self.phase - time.time())))
        most = min(params.get("limit", 1000), PAGE_BYTES // 190)
        end = min(self.rows(), behind + most)
        segments = [] if end == behind else [{
            "segment": 1, "file": f"{self.name}.csv", "metadata": {"instance": self.name, "model": "none"}, "columns": COLUMNS,
            "first": behind + 1, "rows": self.stored[behind:end] + [self.row(i) for i in range(max(behind, len(self.stored)), end)]}]
        return {"log": self.log, "segments": segments, "after": f"{self.log}-1-{end}-{end}", "more": end < self.rows(), "missing": 0}

    async def answer(self, request):
        method, params = request["method"], request.get("params") or {}
        if method == "rows":
            return {"axes": {"z": await self.page(params)}}
        if method == "status":
            return {"name": self.name, "version": "stand-in", "state": "receiving", "axes": {"z": {"quality": "good"}}, "age_s": 0.0}
        return [] if method == "events" else {"streams": []}

    async def serve(self, reader, writer):
        try:
            while line := await reader.readline():
                request = json.loads(line)
                answer = {"jsonrpc": "2.0", "id": request["id"], "result": await self.answer(request)}
                writer.write(json.dumps(answer, separators=(",", ":")).encode() + b"\n")
                await writer.drain()
        except (ConnectionError, asyncio.CancelledError):
            pass
        writer.close()


async def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder")
    parser.add_argument("gyros", type=int)
    parser.add_argument("--backlog", type=int, default=0)
    arguments = parser.parse_args()
    for i in range(arguments.gyros):
        gyro = Gyro(f"gyro{i + 1:04}", arguments.backlog)
        await asyncio.start_unix_server(gyro.serve, os.path.join(arguments.folder, gyro.name + ".sock"), limit=1 << 20)
    print(f"{arguments.gyros} fake servers in {arguments.folder}: no gyros, generated rows", flush=True)
    await asyncio.Event().wait()


asyncio.run(main())
