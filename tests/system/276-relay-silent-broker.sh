# SPDX-License-Identifier: MIT
# A broker that accepts the connection and acknowledges no message is reported as down, and the connection is renewed. Before, it was
# "up" without an error for ever.
. "$(dirname "$0")/lib.sh"
. "$PRISM_SOURCE/tests/system/servers.sh"
port=$(free_port)
start broker python3 "$PRISM_SOURCE/tests/system/silent_broker.py" "$port" "$dir/acknowledge"
relay_config ", \"mqtt\": {\"host\": \"127.0.0.1\", \"port\": $port}"
start_hostile gyro
start_relay
wait_for 10 grep -q connected broker.out
wait_for 5 relay_is .site lab
sleep 0.5  # several statuses
same "the broker before its first acknowledgement" "$(relay_says '.targets.mqtt.up // false')" false
touch acknowledge
wait_for 10 relay_is '.targets.mqtt | "\(.up) \(.error)"' "true "
rm acknowledge
silent() { relay_is '.targets.mqtt | "\(.up) \(.error | test("no acknowledgement for 40 s"))"' "false true"; }
wait_for 55 silent
contains "human-readable status" "$(prismrelay --status relay.json)" "mqtt        DOWN since"
connections() { [ "$(grep -c connected broker.out)" -ge 2 ]; }
wait_for 10 connections
sleep 0.5  # several statuses
silent || fail "the new connection hides the error: $(relay_says .targets.mqtt)"
same "messages" "$(grep -c 'no acknowledgement for 40 s' relay.err)" 1
touch acknowledge
wait_for 20 relay_is '.targets.mqtt | "\(.up) \(.error)"' "true "
rm acknowledge
kill -TERM "$relay"
ended() { ! kill -0 "$relay" 2>/dev/null; }
wait_for 10 ended
