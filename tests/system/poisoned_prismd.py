# SPDX-License-Identifier: MIT
# Fake prismd with a log that grows by 5 rows/s; the number of each row is in its column "samples".
# poisoned_prismd.py SOCKET [ROWS] [missing|position|rounding|axis|events|late]: begins with ROWS rows. "missing": the first page reports
# 2^64-1 deleted rows. "position": the numbers of its rows exceed 32 bits. "rounding": the arrivals are rounded into the next day.
# "axis": the name of its axis has 1 MB. "events": it has the events one, two and three. "late": most rows are not read if a request is
# for one row.
import json, os, socketserver, sys, time

COLUMNS = ("time_utc,time_s,samples,missing,rate_deg_per_h,temperature_degc,uhfo_v,status,mean_rate_deg_per_h,mean_temperature_degc,"
           "slope_degc_per_s,mean_uhfo_v,bias_deg_per_h,sd_deg_per_h,corrected_deg_per_h,corrected_mean_deg_per_h,quality,sd_mean_deg_per_h,arrival_s")
ID = "%032x" % abs(hash(sys.argv[1]))
stored = int(sys.argv[2]) if len(sys.argv) > 2 else 0
kind = sys.argv[3] if len(sys.argv) > 3 else ""
start = time.time()
status = {"state": "receiving", "axes": {"z" * 2**20 if kind == "axis" else "z": {"quality": "good"}}, "log": {"rows": 5}}

events = [{"time_s": start, "severity": "info", "kind": name, "text": name} for name in ("one", "two", "three")]


def available():
    return stored + int((time.time() - start) * 5)


def page(params):
    after = params.get("after")
    begin = 0 if after == "earliest" else int(after.split("-")[1])
    until = time.time() + min(params.get("wait_s", 0), 1)
    while available() <= begin and time.time() < until:
        time.sleep(0.05)
    end = min(available(), begin + params["limit"])
    time_of = lambda i: "2505599.9999994994" if kind == "rounding" else f"{start + (i - stored) / (5 if i > stored else 1):.6f}"
    rows = [f",{int(float(time_of(i)))},{i},0,{8.5 + i % 7},,,0,,,,,,,,,good,,{time_of(i)}" for i in range(begin + 1, end + 1)]
    first = 2**31 - 2 if kind == "position" else begin + 1
    segment = {"segment": 1, "file": "log.csv", "metadata": {"model": "m"}, "columns": COLUMNS, "first": first,
               "rows": rows}
    return {"log": ID, "segments": [segment] if rows else [], "after": f"{ID}-{end}", "more": end < available(),
            "missing": 2**64 - 1 if kind == "missing" and begin == 0 else 0, "kept": 100, "deleted": 7,
            "behind": 51 if kind == "late" and params["limit"] == 1 else 0}


class Client(socketserver.StreamRequestHandler):
    def handle(self):
        for line in self.rfile:
            request = json.loads(line)
            results = {"status": lambda: status, "events": lambda: events if kind == "events" else [], "subscribe": lambda: {"axes": ["z"]},
                       "rows": lambda: {"axes": {"z": page(request["params"])}}}
            answer = {"jsonrpc": "2.0", "id": request["id"], "result": results[request["method"]]()}
            self.wfile.write((json.dumps(answer) + "\n").encode())


class Server(socketserver.ThreadingMixIn, socketserver.UnixStreamServer):
    daemon_threads = True


if os.path.exists(sys.argv[1]):
    os.unlink(sys.argv[1])
Server(sys.argv[1], Client).serve_forever()
