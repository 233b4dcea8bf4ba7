# SPDX-License-Identifier: MIT
# prismweb behind a real nginx, configured as in the man page: the page, responses and the WebSocket pass; a host that is not allowed
# is rejected.
. "$(dirname "$0")/lib.sh"
PATH=$PRISM_BIN/tools/prismweb:$PATH:/usr/sbin
command -v nginx >/dev/null || skip "nginx is not installed (run tools/setup all)"
needs_websockets
cd "$dir"
frames 50
config
start_sim --profile steady
start_prismd
echo '{"socket": "web.sock", "hosts": ["lab3.example"], "instances": ["'"$PRISM_SOCKET"'"], "state": "state"}' >web.json
prismweb --config web.json --check >checked 2>&1 || fail "$(cat checked)"
start web prismweb --config web.json
wait_for 5 test -S web.sock
port=$("$python" -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
awk '/^Behind nginx/ {on = 1} on && /^```/ {n++; next} n == 1' "$PRISM_SOURCE/docs/man/prismweb.8.scd" | sed "s|/run/prismweb/web.sock|$dir/web.sock|" >location
grep -q proxy_pass location || fail "the man page has no nginx example: $(cat location)"
cat >nginx.conf <<END
$([ "$(id -u)" -ne 0 ] || echo "user root;")
pid $dir/nginx.pid; error_log $dir/nginx.err; daemon off;
events {}
http { access_log off; client_body_temp_path $dir/t1; proxy_temp_path $dir/t2; fastcgi_temp_path $dir/t3; uwsgi_temp_path $dir/t4; scgi_temp_path $dir/t5;
  server { listen 127.0.0.1:$port; $(cat location) } }
END
start nginx nginx -c "$dir/nginx.conf" -p "$dir"
url=http://127.0.0.1:$port/
status() { curl -s -o /dev/null -w '%{http_code}' "$@"; }
served() { [ "$(status -H 'Host: lab3.example' "$url")" = 200 ]; }
wait_for 10 served
contains "the page" "$(curl -s -H 'Host: lab3.example' "$url")" "<title>prism"
same "a response" "$(curl -s -H 'Host: lab3.example' "${url}api/instances" | jq -r '.[0].name')" gyro
same "a host that is not allowed" "$(status -H 'Host: evil.example' "$url")" 421
same "the WebSocket" "$("$python" "$PRISM_SOURCE/tests/system/web_client.py" "ws://127.0.0.1:$port/ws" '' hello | jq .ready)" true
same "prismd through the WebSocket" "$("$python" "$PRISM_SOURCE/tests/system/web_client.py" "ws://127.0.0.1:$port/ws" '' ask version | jq -r .result.name)" prismd
kill -TERM "$pid"; wait "$pid" 2>/dev/null || true
