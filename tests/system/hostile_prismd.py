# SPDX-License-Identifier: MIT
# Fake prismd: responds like prismd, but with a text in every field that SQL, CSV, JSON, MQTT, Prometheus or a terminal may interpret.
# hostile_prismd.py SOCKET [ROWS]: ROWS is "rows" (default), or "unreadable" for a log with invalid column names.
import json, os, socketserver, sys, time

HOSTILE = "a\\u0000b\x00c'; DROP TABLE prism.rows;--\"\n\\.\n\033[2J\033]0;title\007\x7f\x9b31m\u202e<img src=x>$(id)`id`+#/"
unreadable = sys.argv[2:] == ["unreadable"]
COLUMNS = ("time_utc,time_s,samples,missing,rate_deg_per_h,temperature_degc,uhfo_v,status,mean_rate_deg_per_h,mean_temperature_degc,"
           "slope_degc_per_s,mean_uhfo_v,bias_deg_per_h,sd_deg_per_h,corrected_deg_per_h,corrected_mean_deg_per_h,quality,sd_mean_deg_per_h,arrival_s")
columns = HOSTILE if unreadable else COLUMNS
begin = int(time.time()) - 5
rows = [f",{begin + i},50,0,,,,0,,,,,,,,,good,,{begin + i}" for i in range(4)] + ([] if unreadable else [HOSTILE])
window = {"axis": "z", "time_s": begin, "rate_deg_per_h": 8.5, "quality": HOSTILE}
status = {"name": HOSTILE, "version": HOSTILE, "state": HOSTILE, "detail": HOSTILE, "gyro_serial": HOSTILE,
          "device": HOSTILE, "frames": HOSTILE, "age_s": 0.1,
          "axes": {"z": {"quality": HOSTILE, "window": window, "model": {"name": HOSTILE, "kind": HOSTILE, "id": HOSTILE}}, HOSTILE: {"quality": "good"}},
          "sensors": {HOSTILE: {"value": 1, "unit": "V"}}, "log": {"rows": 5}}
event = {"time_s": begin, "severity": HOSTILE, "kind": HOSTILE, "text": HOSTILE}
segment = {"segment": 1, "file": HOSTILE, "metadata": {"model": HOSTILE, HOSTILE: [HOSTILE, {"x": HOSTILE}]}, "columns": columns, "first": 1,
           "rows": rows}


def page(after):
    end = "0" * 32 + "-1-6-9"
    return {"log": "0" * 32, "segments": [] if after == end else [segment], "after": end, "more": False, "missing": 0}


class Client(socketserver.StreamRequestHandler):
    def handle(self):
        for line in self.rfile:
            request = json.loads(line)
            method, params = request["method"], request.get("params") or {}
            if method == "rows" and params.get("after") == page("")["after"]:
                time.sleep(0.2)
            of_axes = {"rows": page(params.get("after")), "model": {"name": HOSTILE, "provenance": {HOSTILE: HOSTILE}}, "config": {HOSTILE: HOSTILE},
                       "stability": {"divisor": HOSTILE}, "bias": window, "history": [window]}
            results = {"status": status, "events": [event], "subscribe": {"axes": ["z"]}, "line": {"device": HOSTILE, "notes": [HOSTILE]},
                       **{name: {"axes": {"z": own}} for name, own in of_axes.items()}}
            answer = {"result": results[method]} if method in results else {"error": {"code": -1, "message": HOSTILE}}
            self.wfile.write((json.dumps({"jsonrpc": "2.0", "id": request["id"], **answer}) + "\n").encode())
            if method == "subscribe":
                for name, data in (("event", event), ("window", window), ("window", {**window, "axis": HOSTILE})):
                    self.wfile.write((json.dumps({"jsonrpc": "2.0", "method": name, "params": data}) + "\n").encode())


class Server(socketserver.ThreadingMixIn, socketserver.UnixStreamServer):
    daemon_threads = True


if os.path.exists(sys.argv[1]):
    os.unlink(sys.argv[1])
Server(sys.argv[1], Client).serve_forever()
