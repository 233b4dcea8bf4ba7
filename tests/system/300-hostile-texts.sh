# SPDX-License-Identifier: MIT
# Texts that some language would interpret, through every input and output, with real programs: Chromium, PostgreSQL, mosquitto,
# promtool, a terminal. tests/hostile/ has the texts, a second implementation of the rules, and most of the inputs and outputs.
. "$(dirname "$0")/lib.sh"
. "$PRISM_SOURCE/tests/system/servers.sh"
PATH=$PATH:/usr/sbin
for program in promtool tmux mosquitto chromium; do command -v $program >"$dir/program" || skip "$program is not installed (run tools/setup ci)"; done
/usr/bin/python3 -c 'import selenium' 2>/dev/null || skip "python3-selenium is not installed (run tools/setup ci)"
hostile=$PRISM_SOURCE/tests/hostile
export PYTHONDONTWRITEBYTECODE=1 LC_ALL=C.UTF-8 XDG_RUNTIME_DIR=$dir/run
mkdir -m 700 "$XDG_RUNTIME_DIR"
frames 2
prismsim --profile paper --hours 0.3 --frames frames.json --out cycle.pcap 2>sim.err
echo '{"frames": "./frames.json", "clock": "device", "name": "g"}' >plain.json
prismd plain.json --replay cycle.pcap --out plain >/dev/null 2>plain.err
grep -hv '^#' plain/*.csv >columns

/usr/bin/python3 "$hostile/ways_in.py" "$PRISM_BIN" "$PRISM_SOURCE" "$dir" >in.out || fail "inputs"
/usr/bin/python3 "$hostile/ways_out.py" "$PRISM_BIN" "$PRISM_SOURCE" "$dir" >out.out || fail "outputs"
read -r -a pids <pids || true  # read returns 1: the file has no line end
children+=("${pids[@]}")
count=$(jq length made.json)

# All gyros at once to a database and a broker, with an additional file that is not a socket.
touch "s/$(printf 'x\xff').sock"
start_postgres
server_user=mosquitto
port=$(free_port)
server_folder "$dir/mqtt"
printf 'listener %s 127.0.0.1\nallow_anonymous true\npersistence false\n' "$port" >mqtt/mosquitto.conf
start broker mosquitto -c "$dir/mqtt/mosquitto.conf"
cat >relay.json <<END
{"site": "lab", "instances": "$dir/s/", "status_file": "run/prismrelay.json",
 "postgresql": {"connection": "host=$dir/pg dbname=prism user=relay"}, "mqtt": {"host": "127.0.0.1", "port": $port}}
END
prismrelay --init relay.json >init.out 2>&1 || fail "$(cat init.out)"
start_relay
wait_for 60 sql_is "SELECT count(DISTINCT gyro) FROM prism.rows" "$count"
rows=$(grep -vc '^[#t]' plain/*.csv)
wait_for 60 sql_is "SELECT count(*) FROM prism.rows" "$((count * rows))"
psql -X -q -A -t -h "$dir/pg" -U relay prism -c "SELECT json_agg(json_build_object('gyro', gyro, 'serial', metadata ->> 'gyro_serial')) FROM prism.segments" >segments.json
jq -e --slurpfile made made.json '(map({key: .gyro, value: .serial}) | from_entries) as $found | $made[0] | all($found["lab/" + .instance] == .text)' segments.json >/dev/null ||
  fail "the serial numbers in the database differ: $(cat segments.json)"
relay_rows() { env -u PRISM_SOCKET prismctl metrics >relay.prom; grep -q "prism_relay_rows_total.*} [1-9]" relay.prom; }
wait_for 10 relay_rows  # The relay writes its status once per second.
same "promtool on the metrics of the relay" "$(promtool check metrics <relay.prom 2>&1)" ""
retained() { mosquitto_sub -h 127.0.0.1 -p "$port" -W 3 --retained-only -t 'prism/lab/+/+/status' -F "$1" 2>/dev/null || true; }
topics=$(retained %t)
retained %p | jq -e -s 'length > 20 and all(has("gyro_serial"))' >/dev/null || fail "a retained message is invalid JSON, or too few are retained"
! grep -q 'a+b' <<<"$topics" || fail "a topic contains a wildcard"
LC_ALL=C grep -qP '[\x00-\x09\x0b-\x1f\x7f]' relay.err && fail "control characters in the messages of the relay"

# The web API has the same names, and the page shows them as text.
echo "{\"listen\": \"127.0.0.1:0\", \"state\": \"$dir/state\"}" >web.json
ln -s "$dir/s" run/prismd
: >web.out
start web prismweb --config web.json
wait_for 10 grep -q token= web.out
/usr/bin/python3 "$hostile/browser_out.py" "$PRISM_SOURCE" "$dir" "$(cat web.out)" >browser.out || fail "the pages in Chromium"
[ -z "$(find "$dir" -name pwned -not -path "*/mqtt/*")" ] || fail "a text was executed"
cat in.out out.out browser.out
