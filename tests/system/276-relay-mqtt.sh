# SPDX-License-Identifier: MIT
# prismrelay with a real MQTT broker, TLS and a password: the retained state of each gyro is correct when the gyro, the relay or the
# broker stops and restarts.
. "$(dirname "$0")/lib.sh"
. "$PRISM_SOURCE/tests/system/servers.sh"
needs_mosquitto
openssl req -x509 -newkey rsa:2048 -nodes -days 2 -keyout ca.key -out ca.pem -subj "/CN=test" 2>/dev/null
openssl req -newkey rsa:2048 -nodes -keyout broker.key -out broker.csr -subj "/CN=localhost" 2>/dev/null
openssl x509 -req -in broker.csr -CA ca.pem -CAkey ca.key -CAcreateserial -days 2 -out broker.pem 2>/dev/null
server_folder "$dir/mqtt"
cp ca.pem broker.pem broker.key mqtt/
mosquitto_passwd -b -c mqtt/users relay "open sesame" 2>/dev/null
printf 'listener %s 127.0.0.1\nallow_anonymous false\npassword_file %s/mqtt/users\ncafile %s/mqtt/ca.pem\ncertfile %s/mqtt/broker.pem\nkeyfile %s/mqtt/broker.key\npersistence false\n' "$port" "$dir" "$dir" "$dir" "$dir" >mqtt/mosquitto.conf
[ "$(id -u)" -ne 0 ] || chown -R mosquitto mqtt
start_broker() { start broker mosquitto -c "$dir/mqtt/mosquitto.conf"; broker=$pid; }
listen() { mosquitto_sub -h localhost -p "$port" --cafile ca.pem -u relay -P "open sesame" -q 1 "$@" 2>sub.err; }
retained() { listen -W 2 -C 1 --retained-only -t "$1" || true; }
is_retained() { [ "$(retained "$1" | jq -r "$2")" = "$3" ]; }
relay_word() { [ "$(retained prism/lab/relay)" = "$1" ]; }
start_broker
wait_for 10 listen -W 1 -C 1 -t '$SYS/broker/version'

echo "open door" >password
chmod 600 password
frames 50
config
jq ".socket.path = \"$dir/a+b.sock\" | .line.device = \"/nowhere\" | .log.directory = \"$dir/log2\"" gyro.json >wild.json
relay_config ", \"mqtt\": {\"host\": \"localhost\", \"port\": $port, \"user\": \"relay\", \"password_file\": \"password\", \"tls\": {\"ca_file\": \"ca.pem\"}}"
start_sim --profile steady
start_prismd
start wild prismd wild.json
start_relay
wait_for 15 relay_is '.targets.mqtt.error | test("refused")' true
kill -TERM "$relay"; wait "$relay" || fail "exit code $?"
chmod 644 password; echo "open sesame" >password
start_relay
wait_for 10 relay_is '.targets.mqtt.error | test("readable by all users")' true
chmod 600 password  # the relay retries
wait_for 15 relay_is .targets.mqtt.up true
! grep -q "open sesame" relay.err status.json || fail "the password is in the log or the status"
wait_for 10 is_retained prism/lab/gyro/z/status '.state + (.quality | test("^(warming|good)$") | tostring)' runningtrue
same "the relay" "$(retained prism/lab/relay)" online
same "a window each second" "$(listen -W 5 -C 3 -t prism/lab/gyro/z/window | jq -s 'map(.time_s) | .[2] - .[0]')" 2
contains "message about a name with a wildcard" "$(cat relay.err)" 'mqtt: the gyro "a+b" is not published: MQTT reserves +, # and a leading $ in topics'

# Hostile texts in every response, and invalid names: all topics are of valid names, and all messages are JSON.
start_hostile hostile
start_hostile '$share'
touch "$dir/"$'\xff.sock'
wait_for 15 is_retained prism/lab/hostile/z/status '.model.name | test("DROP TABLE")' true
wait_for 10 grep -q '"$share" is not published' relay.err
wait_for 10 grep -q 'lab/hostile axis .* skipped: expected 1 to 16 letters' relay.err
listen -W 3 -v -t 'prism/#' >topics.txt || true
! grep -v '^prism/lab/\(relay\|gyro/\|hostile/event \|hostile/z/\)' topics.txt || fail "topics of invalid names"
sed -n 's|^prism/lab/[a-z]*/[a-z/]* ||p' topics.txt | jq -e .  >parsed || fail "a message is invalid JSON"
is_printable relay.err || fail "the log of the relay is not printable"
same "messages about invalid names" "$(grep -c 'share" is not published\|xff.sock: skipped' relay.err)" 2
kill -0 "$relay" || fail "the relay ended"
start events stdbuf -oL mosquitto_sub -h localhost -p "$port" --cafile ca.pem -u relay -P "open sesame" -q 1 -t prism/lab/relay -t prism/lab/gyro/event
wait_for 10 grep -q online events.out

# The gyro is unplugged, then prismd is killed: the broker does not retain the old values.
kill -TERM "$sim"; wait "$sim" 2>/dev/null || true
wait_for 10 grep -q line_lost events.out
wait_for 15 is_retained prism/lab/gyro/z/status '"\(.quality) \(.window.rate_deg_per_h)"' "no_data null"
kill -9 "$prismd"; wait "$prismd" 2>/dev/null || true
wait_for 15 is_retained prism/lab/gyro/z/status '"\(.state) \(.sample)"' "gone null"
start_sim --profile steady
start_prismd
wait_for 20 is_retained prism/lab/gyro/z/status .state running

# The broker restarts without persistence: the relay publishes the last value of each topic again.
kill -9 "$broker"; wait "$broker" 2>/dev/null || true
wait_for 20 relay_is .targets.mqtt.up false
start_broker
wait_for 40 relay_is .targets.mqtt.up true
wait_for 5 is_retained prism/lab/gyro/z/status .state running
same "the relay after the restart of the broker" "$(retained prism/lab/relay)" online
same "failures of the broker are counted" "$(relay_says '.targets.mqtt.failures > 0')" true

# If the relay is killed, the broker publishes "offline"; after SIGTERM the relay does.
kill -9 "$relay"; wait "$relay" 2>/dev/null || true
wait_for 40 relay_word offline
start_relay
wait_for 15 relay_word online
kill -TERM "$relay"; wait "$relay" || fail "exit code $?"
wait_for 5 relay_word offline
