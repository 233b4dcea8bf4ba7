# SPDX-License-Identifier: MIT
# Statuses that the broker retains from before the start of the relay: those of gyros and axes that do not run become "gone".
# Before, MQTT reported such a gyro as running with its old values for ever.
. "$(dirname "$0")/lib.sh"
. "$PRISM_SOURCE/tests/system/servers.sh"
needs_mosquitto
server_folder "$dir/mqtt"
printf 'listener %s 127.0.0.1\nallow_anonymous true\npersistence true\npersistence_location %s/mqtt/\nmax_inflight_messages 0\nmax_queued_messages 0\n' "$port" "$dir" >mqtt/mosquitto.conf
[ "$(id -u)" -ne 0 ] || chown -R mosquitto mqtt
start_broker() { start broker mosquitto -c "$dir/mqtt/mosquitto.conf"; broker=$pid; wait_for 10 mosquitto_sub -p "$port" -W 1 -C 1 -t '$SYS/broker/version'; }
retained() { mosquitto_sub -p "$port" -W 5 -C 1 --retained-only -t "$1" 2>/dev/null || true; }
is_retained() { [ "$(retained "$1" | jq -r "$2")" = "$3" ]; }
publish() { mosquitto_pub -p "$port" -q 1 -r -t "$1" -m "$2"; }
start_broker
frames 50
config
relay_config ", \"mqtt\": {\"host\": \"127.0.0.1\", \"port\": $port}"
start_sim --profile steady
start_prismd
start_relay
wait_for 15 is_retained prism/lab/gyro/z/status .state running

# The host fails: relay, prismd and broker are killed together; the broker keeps its memory on disk. Then the socket is gone, too.
kill -USR1 "$broker"  # saves
wait_for 5 grep -q prism/lab/gyro/z/status mqtt/mosquitto.db
kill -9 "$relay" "$prismd"; wait "$relay" "$prismd" 2>/dev/null || true
kill -TERM "$broker"; wait "$broker" || true
rm -f gyro.sock
start_broker
wait_for 5 is_retained prism/lab/gyro/z/status .state running  # the broker kept its memory
running='{"axis": "z", "state": "running", "quality": "good", "window": {"rate_deg_per_h": 8}}'
publish prism/lab/removed/z/status "$running"
publish prism/lab/text/z/status 'not JSON'
publish prism/lab/before/z/status '{"axis": "z", "state": "gone", "since_s": 5}'
publish prism/lab/alive/old_axis/status "$running"
publish prism/lab/alive/z/status "$running"
publish prism/other/gyro/z/status "$running"
publish prism/lab/gyro/z/else "$running"
publish prism/lab/gyro/status "$running"
publish 'prism/lab/gyro/bad axis/status' "$running"
many=1500
python3 - "$port" "$many" <<'END' || fail "cannot publish many topics"
import socket, sys
port, many = int(sys.argv[1]), int(sys.argv[2])
text = b'{"state": "running"}'
def packet(kind, body):
    size, head = len(body), b""
    while True:
        head += bytes([size % 128 | (128 if size > 127 else 0)])
        size //= 128
        if not size:
            return bytes([kind]) + head + body
string = lambda value: len(value).to_bytes(2, "big") + value
link = socket.create_connection(("127.0.0.1", port))
link.sendall(packet(0x10, string(b"MQTT") + b"\x04\x02\x00\x3c" + string(b"many")))
link.recv(4)
for number in range(many):
    link.sendall(packet(0x31, string(b"prism/lab/many%d/z/status" % number) + text))
link.sendall(b"\xc0\x00")
assert link.recv(2) == b"\xd0\x00"
link.sendall(b"\xe0\x00")
END
start_hostile alive
start_relay
wait_for 10 is_retained prism/lab/gyro/z/status '"\(.state) \(.quality) \(.window)"' "gone no_data null"
wait_for 3 is_retained prism/lab/removed/z/status .state gone
wait_for 3 is_retained prism/lab/text/z/status .state gone
wait_for 3 is_retained prism/lab/alive/old_axis/status .state gone
wait_for 5 is_retained prism/lab/alive/z/status .state running
same "a state that was gone" "$(retained prism/lab/before/z/status | jq .since_s)" 5
same "the state of another site" "$(retained prism/other/gyro/z/status)" "$running"
for topic in gyro/z/else gyro/status 'gyro/bad axis/status'; do same "the topic $topic" "$(retained "prism/lab/$topic")" "$running"; done
all_gone() { [ "$(mosquitto_sub -p "$port" -W 10 -C $((many + 5)) --retained-only -t 'prism/lab/+/z/status' 2>/dev/null | grep -c '"gone"')" -eq $((many + 4)) ]; }  # and 3 above, and gyro
wait_for 20 all_gone
same "messages about the broker: one for each relay" "$(grep -c 'mqtt: ' relay.err)" 2

# The gyro runs again, while the relay runs.
start_sim --profile steady
start_prismd
wait_for 15 is_retained prism/lab/gyro/z/status .state running

# An instance that the configuration names and that does not run.
kill -TERM "$relay"; wait "$relay" || fail "exit code $?"
publish prism/lab/named/z/status "$running"
jq '.instances = ["/nowhere/named.sock", .instances]' relay.json >named.json && mv named.json relay.json
start_relay
wait_for 10 is_retained prism/lab/named/z/status .state gone
wait_for 5 is_retained prism/lab/gyro/z/status .state running
kill -TERM "$relay"; wait "$relay" || fail "exit code $?"
