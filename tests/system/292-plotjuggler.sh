# SPDX-License-Identifier: MIT
# Data of a simulated gyro as datagrams for PlotJuggler: a timestamp and a number per curve, also after a restart of prismd. An invalid
# address is rejected.
. "$(dirname "$0")/lib.sh"
PATH=$PRISM_BIN/tools/prismweb:$PATH
cd "$dir"
frames 50
config
echo '{"listen": "127.0.0.1:0", "plotjuggler": {"send_to": "nowhere"}}' >bad.json
code=0; prismweb --config bad.json --check 2>refused || code=$?
same "exit code for an invalid address" "$code" 78
contains "the error" "$(cat refused)" 'send_to: found "nowhere", expected ADDRESS:PORT'
start_sim --profile steady
start_prismd
cat >listen.py <<'END'
import json, socket, sys
def curves(prefix, value):
    if isinstance(value, dict):
        for key, below in value.items(): yield from curves(f"{prefix}/{key}", below)
    elif isinstance(value, (int, float)): yield prefix, value
s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
s.bind(("127.0.0.1", 0))
open("port.part", "w").write(str(s.getsockname()[1])); import os; os.rename("port.part", "port")
while True:
    datagram = json.loads(s.recv(65536))
    time = datagram.pop("timestamp")
    for name, value in curves("", datagram): print(time, name, value, flush=True)
END
start curves python3 listen.py
wait_for 5 test -s port
XDG_RUNTIME_DIR=$dir
export XDG_RUNTIME_DIR
start_web "\"plotjuggler\": {\"send_to\": \"127.0.0.1:$(cat port)\", \"samples\": true}"
rows() { awk -v name="$1" '$2 == name' curves.out; }
more_than() { [ "$(rows "$1" | wc -l)" -gt "$2" ]; }
wait_for 10 more_than /gyro/z/window/rate_deg_per_h 3
wait_for 10 more_than /gyro/z/sample/rate_deg_per_h 100
same "times that do not increase" "$(rows /gyro/z/sample/rate_deg_per_h | awk '$1 <= last {n++} {last = $1} END {print n + 0}')" 0
same "rates outside 8 to 9 deg/h" "$(rows /gyro/z/window/rate_deg_per_h | awk '$3 < 8 || $3 > 9 {n++} END {print n + 0}')" 0
same "data of an unknown slope" "$(rows /gyro/z/window/slope_degc_per_s | wc -l)" 0
kill -9 "$prismd"; wait "$prismd" 2>/dev/null || true
before=$(rows /gyro/z/sample/rate_deg_per_h | wc -l)
start_prismd
wait_for 10 more_than /gyro/z/sample/rate_deg_per_h $((before + 100))
