# SPDX-License-Identifier: MIT
# prismweb with a real prismd: authentication, forwarded requests, every sample to two clients at 1000 frames/s, a client that does
# not read, a restart of prismd, the stored minutes, Unix sockets, and a stopped instance.
. "$(dirname "$0")/lib.sh"
needs_websockets
frames 1000
jq '.name = "<script>alert(1)</script>"' "$PRISM_SOURCE/config/models/tao2019-model2.json" >script.json
config
jq --arg model "$dir/script.json" '.model = $model' gyro.json >other.json && mv other.json gyro.json
start_sim --profile steady --hours 1
start_prismd

# A non-loopback address is rejected, and so are a host name and a configuration of 0.3 with TLS and passwords.
refused() { code=0; prismweb "$@" --state "" --instance "$PRISM_SOCKET" >refused 2>&1 </dev/null || code=$?; echo "$code $(cat refused)"; }
recipe='let nginx or caddy serve other hosts (page.md, "Other hosts")'
same "a non-loopback address" "$(refused --listen 0.0.0.0:0)" "64 prismweb: --listen: found 0.0.0.0, expected a loopback address; $recipe"
echo '{"listen": "[::]:0"}' >old.json
same "a non-loopback address of the configuration" "$(refused --config old.json)" "78 prismweb: old.json:/listen: found ::, expected a loopback address; $recipe"
echo '{"listen": "127.0.0.1:0", "foxglove": {}, "tls": {"certificate": "web.crt", "key": "web.key"}}' >old.json
same "TLS" "$(refused --config old.json)" '78 prismweb: old.json:/tls: removed in prism 0.4 (line 1); let nginx or caddy have the certificate (page.md, "Other hosts")'
echo '{"listen": "127.0.0.1:0", "passwords": "web.passwords"}' >old.json
same "passwords" "$(refused --config old.json)" '78 prismweb: old.json:/passwords: removed in prism 0.4 (line 1); let nginx or caddy ask for the passwords (page.md, "Other hosts")'
echo '{"listen": "127.0.0.1:0", "foxglove": {}}' >old.json
contains "a removed key that opens no door" "$(refused --config old.json --check)" "0 prismweb: warning: old.json:/foxglove: removed in prism 0.4 (line 1); it has no effect"
code=0; prismweb --listen lab:80 2>refused || code=$?
same "exit code for a host name" "$code" 64

mkdir -p page/.git
echo "<!DOCTYPE html><title>prism</title>" >page/index.html
touch page/.git/config
start first_web prismweb --listen 127.0.0.1:0 --page page --state state --instance "$PRISM_SOCKET"
web=$pid
wait_for 5 grep -q token= first_web.out
url=$(sed 's/#.*//' first_web.out)
token=$(program_token first_web.out)
port=$(sed 's|.*:\([0-9]*\)/#.*|\1|' first_web.out)
[ "$(sed 's/.*#token=//' first_web.out)" != "$token" ] || fail "the token for programs is in the printed address"
same "mode of the token's file" "$(stat -c %a "prismweb-$port.token")" 600
client() { "$python" "$PRISM_SOURCE/tests/system/web_client.py" "ws://127.0.0.1:$port/ws" "$@"; }
status() { curl -s -o /dev/null -w '%{http_code}' "$@"; }
api() { curl -s -H "Authorization: Bearer $token" "${url}api/$1"; }
running() { [ "$(api instances | jq -r '.[0].state')" = running ]; }
wait_for 5 running

# Authentication.
same "the page without a token" "$(status "$url")" 200
same "without a token" "$(status "${url}api/instances")" 401
same "a wrong token" "$(status -H "Authorization: Bearer x$token" "${url}api/instances")" 401
same "/metrics without a token" "$(status "${url}metrics")" 401
same "another name of this host" "$(status -H 'Host: rebound.example' "$url")" 421
same "an origin of another site" "$(status -H 'Origin: http://evil.example' "$url")" 403
same "its own origin" "$(status -H "Origin: http://localhost:$port" "$url")" 200
same "a WebSocket with a wrong token" "$(client wrong hello)" "closed 1008"
same "a WebSocket without a token" "$(client '' hello)" "closed 1008"
same "greeting" "$(client "$token" hello | jq -c '[.ready, .instances]')" '[true,[{"axes":["z"],"name":"gyro","state":"running"}]]'
same "an unknown axis" "$(client "$token" ask subscribe '{"axes": ["q"]}' | jq -c '[.error.code, .error.message]')" '[-32602,"found the axis \"q\", expected one of z"]'
same "/metrics with a query" "$(status -H "Authorization: Bearer $token" "${url}metrics?x=1")" 200
headers=$(curl -sI "$url")
contains "headers" "$headers" "Content-Security-Policy: default-src 'self'; frame-ancestors 'none'"
contains "headers" "$headers" "X-Content-Type-Options: nosniff"
contains "headers" "$headers" "Referrer-Policy: no-referrer"
tag=$(sed -n 's/^ETag: \(.*\)\r/\1/p' <<<"$headers")
same "a file that did not change" "$(status -H "If-None-Match: $tag" "$url")" 304
for target in 'x/../../../etc/passwd' '..%2f..%2fetc%2fpasswd' '.git/config' 'index.php'; do
  same "$target" "$(status --path-as-is "$url$target")" 404
done
same "a header that is too long" "$(status -H "X-Long: $(head -c 9000 /dev/zero | tr "\0" x)" "$url")" 431
same "a body" "$(status -X POST -d x=1 "$url")" 400

# Read-only requests are forwarded; the text of a model is sent as data.
for method in reload config shutdown; do
  contains "$method" "$(client "$token" ask $method)" "no method \\\"$method\\\""
  same "/api/gyro/$method" "$(status -H "Authorization: Bearer $token" "${url}api/gyro/$method")" 404
done
same "a model's name" "$(client "$token" ask model | jq -r .result.axes.z.name)" "<script>alert(1)</script>"
same "its media type" "$(curl -s -o /dev/null -w '%{content_type}' -H "Authorization: Bearer $token" "${url}api/gyro/model")" application/json
same "a response of prismd" "$(client "$token" ask version | jq -c '[.jsonrpc, .id, .result.name, .instance]')" '["2.0","q","prismd","gyro"]'
same "the results of /api" "$(api gyro/bias | jq -c '.axes | keys')" '["z"]'
same "the same for a script of 0.3" "$(api 'gyro/bias?protocol=2' | jq -c '.axes | keys')" '["z"]'
older=$(PRISM_PROTOCOL=1 client "$token" ask bias | jq -c '[.error.code, .error.message]')
same "a client of 0.2" "$older" '[-32600,"expected \"protocol\": 2 in the request: this client is older than prism 0.3; upgrade it"]'
contains "wrong params, rejected by prismd" "$(client "$token" ask history '{"seconds":0}')" '"code": -32602'
# prismd closes a connection on a request that is too long, and all clients share this connection.
contains "params that are too long" "$(client "$token" ask history "{\"seconds\":[$(seq -s, 3000)]}")" "expected at most 2000"
same "state after params that are too long" "$(api instances | jq -r '.[0].state')" running
contains "the name of a consumer" "$(client "$token" ask rows '{"name":"x"}')" '"code": -32602'
contains "an unknown instance" "$(client "$token" ask status '{}' '<b>')" 'no instance \"<b>\"'
first_row() { [ "$(client "$token" ask rows '{"limit":1}' | jq '.result.axes.z.segments[0].rows | length')" = 1 ]; }  # needs one complete second
wait_for 10 first_row
metrics=$(curl -s -D metrics.head -H "Authorization: Bearer $token" "${url}metrics")
contains "/metrics" "$metrics" 'prism_up{gyro="gyro"} 1'
contains "its media type" "$(cat metrics.head)" "Content-Type: text/plain; version=0.0.4"
same "/api of an unknown instance" "$(status -H "Authorization: Bearer $token" "${url}api/none/bias")" 404

# Two clients with all 1000 frames/s, one with every tenth frame, and one that does not read.
start deaf client "$token" deaf
deaf=$pid
for name in first second; do start $name client "$token" listen 4000 1; eval "$name=$pid"; done
start tenth client "$token" listen 400 10
wait "$first"; wait "$second"; wait "$pid"
for name in first second; do
  same "$name: gaps and losses" "$(jq '[.holes, .lost, .prismd_lost]' -c $name.out)" '[0,0,0]'
  same "$name: at most 25 messages a second" "$(jq '.messages_per_s <= 25' $name.out)" true
done
same "every tenth" "$(jq -c '(.step_ms - 10 | fabs < 0.5) and .lost == 0' tenth.out)" true  # the step changes once, when the others leave

# prismd restarts: a client is notified and gets data again without a new subscription.
start follow client "$token" follow follow.txt
follow=$pid
wait_for 5 grep -q ^window follow.txt
kill -TERM "$prismd"; wait "$prismd"
gone() { [ "$(api instances | jq -r '.[0].state')" = gone ]; }
wait_for 5 gone
contains "/metrics of a stopped prismd" "$(curl -s -H "Authorization: Bearer $token" "${url}metrics")" 'prism_up{gyro="gyro"} 0'
same "/api of a stopped prismd" "$(status -H "Authorization: Bearer $token" "${url}api/gyro/bias")" 503
start_prismd
wait_for 5 running
wait "$follow"
contains "the notification" "$(grep ^instances follow.txt)" '"state": "gone"'
contains "windows before and after" "$(sed 's/ .*//' follow.txt | uniq | tr '\n' ' ')" "window instances window "

wait "$deaf"
same "losses reported to the client that did not read" "$(jq '.lost > 0' deaf.out)" true
[ "$(awk '/^VmHWM/{print $2}' "/proc/$web/status")" -lt 65536 ] || fail "prismweb used $(grep VmHWM "/proc/$web/status"), expected less than 64 MiB"
kill -TERM "$web"; wait "$web" || fail "exit code $?"
same "the token for programs after the end" "$(cat "prismweb-$port.token")" "$token"
first_token=$token

# The stored minutes equal the log after the end or a kill of prismweb: no row is missing or counted twice. A minute takes a second.
kill -TERM "$sim" "$prismd"; wait "$sim" "$prismd" || fail "exit code $?"
frames 10
start_sim --profile steady --speed 60
start_prismd
web_again() {
  : >web.out
  start web prismweb --listen "127.0.0.1:$port" --state state --instance "$PRISM_SOCKET"
  web=$pid
  wait_for 5 grep -q token= web.out
  token=$(program_token)
  wait_for 5 running
}
of_log() { grep -hv '^[#t]' log/*.csv | awk -F, -v to="$1" '$2 <= to {n += 1; s += $3; if (n == 1 || $5 < l) l = $5; if (n == 1 || $5 > g) g = $5} END {printf "%d %d %.6f %.6f\n", n, s, l, g}'; }
of_store() { jq -r '.columns as $c | [.rows[] | [., $c] | transpose | map({(.[1]): .[0]}) | add] |
  "\(map(.seconds) | add) \(map(.samples) | add) \(map(.rate_min) | min) \(map(.rate_max) | max)"' | awk '{printf "%d %d %.6f %.6f\n", $1, $2, $3, $4}'; }
last_s() { api 'gyro/range?seconds=100&points=5' | jq .last_s; }
moves_on() { [ "$(last_s)" -gt "$1" ]; }
up_to_date() { [ "$(api 'gyro/range?seconds=200000&points=5000' | jq ".building * 1")" = 1 ]; }
store_is_log() {
  api 'gyro/range?seconds=200000&points=5000' >range.json
  [ "$(of_store <range.json)" = "$(of_log "$(jq .last_s range.json)")" ]
}
for end in -KILL -TERM -KILL; do
  web_again
  same "the token after a restart" "$token" "$first_token"
  wait_for 5 up_to_date
  wait_for 5 moves_on $(($(last_s) + 120))
  wait_for 5 up_to_date
  wait_for 5 store_is_log  # the last second may reach the store after last_s
  same "source" "$(jq -r .source range.json)" minutes; same "axis" "$(jq -r .axis range.json)" z
  kill $end "$web"; wait "$web" 2>/dev/null || true
done
chmod 644 "prismweb-$port.token"   # others may have read it
web_again
[ "$token" != "$first_token" ] || fail "a token that others could read was used again"
same "mode of the new token's file" "$(stat -c %a "prismweb-$port.token")" 600
kill -TERM "$web"; wait "$web" || fail "exit code $?"
[ "$(stat -c %s state/gyro/z/periods.sqlite)" -gt 4096 ] || fail "no minute was stored"

# A Unix socket needs no token, but an allowed host.
start unix prismweb --page page --socket "$dir/web.sock" --instance "$PRISM_SOCKET"
opened() { [ -S web.sock ] && [ "$(stat -c %a web.sock)" != 0 ]; }  # no client may connect before its group is set
wait_for 5 opened
same "mode of the Unix socket" "$(stat -c %a web.sock)" 660
same "a Unix socket" "$(curl -s --unix-socket web.sock http://localhost/api/instances | jq -r '.[0].name')" gyro
same "another host on the Unix socket" "$(status --unix-socket web.sock http://evil.example/)" 421
kill -TERM "$pid"; wait "$pid" || fail "exit code $?"
[ ! -e web.sock ] || fail "prismweb did not remove its socket"

# A stopped instance: systemd listens on its socket (prismd@.socket keeps the directories), and prismweb connects only when it runs.
# After a service closed the connection, prismweb does not connect to the same run of it again: it may be stopping.
mkdir -p held/activated
ln -s ../held.sock held/activated/held.sock
start held socat "UNIX-LISTEN:held/held.sock,fork" SYSTEM:"echo knock >>$dir/knocks"
wait_for 5 test -S held/held.sock
start resting prismweb --listen 127.0.0.1:0 --state state --instance "$dir/held/held.sock"
wait_for 5 grep -q token= resting.out
url=$(sed 's/#.*//' resting.out)
token=$(program_token resting.out)
instance_is() { [ "$(api instances | jq -r '.[0].state')" = "$1" ]; }
wait_for 5 instance_is stopped
sleep 0.5  # several attempts
[ ! -e knocks ] || fail "prismweb connected to a stopped instance"
mkdir -p held/running/held
knocked() { [ "$(wc -l <knocks)" = "$1" ]; }
wait_for 5 knocked 2  # one connection each for short and for long requests
sleep 0.5  # several attempts
same "connections while the service ends" "$(wc -l <knocks)" 2
rmdir held/running/held
wait_for 5 instance_is stopped
mkdir held/running/held
wait_for 5 knocked 4
