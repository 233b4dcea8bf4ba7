# SPDX-License-Identifier: MIT
# The example for PlotJuggler with a simulated gyro: datagrams with a timestamp and a number per curve, also after a restart of prismd.
. "$(dirname "$0")/lib.sh"
command -v python3 >/dev/null || skip "no python3"
export PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=$PRISM_SOURCE/clients/python
frames 50
config
start_sim --profile steady --speed 10
start_prismd
cat >listen.py <<'END'
import json, os, socket
def curves(prefix, value):
    if isinstance(value, dict):
        for key, below in value.items(): yield from curves(f"{prefix}/{key}", below)
    elif isinstance(value, (int, float)): yield prefix, value
s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
s.bind(("127.0.0.1", 0))
open("port.part", "w").write(str(s.getsockname()[1])); os.rename("port.part", "port")
while True:
    datagram = json.loads(s.recv(65536))
    time = datagram.pop("timestamp")
    for name, value in curves("", datagram): print(time, name, value, flush=True)
END
start curves python3 listen.py
wait_for 5 test -s port
example=$PRISM_SOURCE/clients/python/examples/plotjuggler.py
start seconds python3 "$example" --to "127.0.0.1:$(cat port)"
start frames python3 "$example" --to "localhost:$(cat port)" --every 1
rows() { awk -v name="$1" '$2 == name' curves.out; }
more_than() { [ "$(rows "$1" | wc -l)" -gt "$2" ]; }
wait_for 10 more_than /gyro/z/window/rate_deg_per_h 3
wait_for 10 more_than /gyro/z/sample/rate_deg_per_h 100
same "times that do not increase" "$(rows /gyro/z/sample/rate_deg_per_h | awk '$1 <= last {n++} {last = $1} END {print n + 0}')" 0
same "rates outside 8 to 9 deg/h" "$(rows /gyro/z/window/rate_deg_per_h | awk '$3 < 8 || $3 > 9 {n++} END {print n + 0}')" 0
python3 - <<'END' || fail "curves of the slope"
import prism
rows = [line.split() for line in open("curves.out")]
rows = [row for row in rows if row[0] != rows[-1][0]]  # the last datagram may be half printed
history = {row.time_s: row.slope_degc_per_s for row in prism.Gyro().history(3600)}
times = {name: {float(time) for time, each, _ in rows if each == "/gyro/z/window/" + name} for name in ("rate_deg_per_h", "slope_degc_per_s")}
expected = {time for time in times["rate_deg_per_h"] if history[time] is not None}
assert times["slope_degc_per_s"] == expected, f"found a slope at {sorted(times['slope_degc_per_s'])}, expected one at {sorted(expected)}"
END
kill -9 "$prismd"; wait "$prismd" 2>/dev/null || true
before=$(rows /gyro/z/sample/rate_deg_per_h | wc -l)
start_prismd
wait_for 10 more_than /gyro/z/sample/rate_deg_per_h $((before + 100))
