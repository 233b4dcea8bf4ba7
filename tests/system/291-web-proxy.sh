# SPDX-License-Identifier: MIT
# The recipes of docs/page.md: prismweb on a Unix socket behind a real nginx and a real caddy, with TLS and users. The page, responses and the
# WebSocket pass with the right password only; a host that is not allowed is rejected.
. "$(dirname "$0")/lib.sh"
PATH=$PATH:/usr/sbin
needs_websockets
frames 50
config
start_sim --profile steady
start_prismd
# recipe LANGUAGE: prints the example of docs/page.md with this test's files.
recipe() {
  awk -v fence='```'"$1" '$0 == fence {on = 1; next} /^```/ {on = 0} on' "$PRISM_SOURCE/docs/page.md" |
    sed "s|/run/prismweb/|$dir/|; s|/etc/ssl/[a-z/]*lab3|$dir/lab3|g; s|/etc/nginx/|$dir/|"
}
sed -n 's/^    \({"socket": .*\)}$/\1/p' "$PRISM_SOURCE/docs/page.md" | sed "s|/run/prismweb/|$dir/|; s|\$|, \"instances\": \"$PRISM_SOCKET\", \"state\": \"\"}|" >web.json
prismweb --config web.json --check >checked 2>&1 || fail "$(cat checked)"
start web prismweb --config web.json
mode_of_socket_is() { [ "$(stat -c %a web.sock)" = "$1" ]; }
wait_for 5 mode_of_socket_is 660
openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -keyout lab3.key -out lab3.crt -days 2 -subj /CN=lab3.example -addext subjectAltName=DNS:lab3.example 2>/dev/null

# through NAME PORT: checks what passes the server NAME at this port.
through() {
  local name=$1 port=$2 site=https://lab3.example:$2/
  get() { curl -s --cacert lab3.crt --resolve "lab3.example:$port:127.0.0.1" "$@"; }
  status() { get -o /dev/null -w '%{http_code}' "$@"; }
  serves() { [ "$(status -u 'look:a secret' "$site")" = 200 ]; }
  wait_for 10 serves
  socket() { PRISM_BASIC=$1 PRISM_CONNECT=127.0.0.1 "$python" "$PRISM_SOURCE/tests/system/web_client.py" "wss://lab3.example:$port/ws" '' "${@:2}"; }
  contains "$name: the page" "$(get -u 'look:a secret' "$site")" "<title>prism"
  same "$name: a response" "$(get -u 'look:a secret' "${site}api/instances" | jq -r '.[0].name')" gyro
  for path in '' api/instances metrics ws; do
    same "$name: /$path without a password" "$(status "$site$path")" 401
    same "$name: /$path with a wrong password" "$(status -u look:wrong "$site$path")" 401
  done
  contains "$name: HSTS" "$(get -u 'look:a secret' -o /dev/null -D - "$site" | tr 'A-Z' 'a-z')" "strict-transport-security: max-age=31536000"
  same "$name: an origin of another site" "$(status -u 'look:a secret' -H 'Origin: https://evil.example' "$site")" 403
  same "$name: the WebSocket" "$(socket 'look:a secret' hello | jq .ready)" true
  same "$name: prismd through the WebSocket" "$(socket 'look:a secret' ask version | jq -r .result.name)" prismd
  same "$name: the WebSocket with a wrong password" "$(socket look:wrong hello)" "refused 401"
  same "$name: HTTP without TLS" "$(curl -s -o answer -w '%{http_code}' "http://127.0.0.1:$port/")" 400
}

missing=()
if command -v nginx >/dev/null; then
  port=$(free_port)
  echo "look:$(openssl passwd -apr1 'a secret')" >prism.users
  recipe nginx | sed "s|listen 443|listen 127.0.0.1:$port|" >site
  grep -q proxy_pass site || fail "docs/page.md has no nginx recipe: $(cat site)"
  cat >nginx.conf <<END
$([ "$(id -u)" -ne 0 ] || echo "user root;")
pid $dir/nginx.pid; error_log $dir/nginx.err; daemon off;
events {}
http { access_log off; client_body_temp_path $dir/t1; proxy_temp_path $dir/t2; fastcgi_temp_path $dir/t3; uwsgi_temp_path $dir/t4; scgi_temp_path $dir/t5;
  $(cat site) }
END
  start nginx nginx -c "$dir/nginx.conf" -p "$dir"
  nginx=$pid
  through nginx "$port"
  same "nginx: a host that is not allowed" "$(status -u 'look:a secret' -H 'Host: evil.example' "https://lab3.example:$port/")" 421
  kill -TERM "$nginx"; wait "$nginx" 2>/dev/null || true
else
  missing+=(nginx)
fi
if command -v caddy >/dev/null; then
  port=$(free_port)
  export HOME=$dir XDG_DATA_HOME=$dir/caddy XDG_CONFIG_HOME=$dir/caddy
  recipe caddy | sed "s|^lab3.example|https://lab3.example:$port|; s|NAME HASH|look $(caddy hash-password --plaintext 'a secret')|" >site
  grep -q reverse_proxy site || fail "docs/page.md has no caddy recipe: $(cat site)"
  { echo "{"; echo "  admin off"; echo "  auto_https disable_redirects"; echo "}"; cat site; } >Caddyfile
  start caddy caddy run --config Caddyfile --adapter caddyfile
  caddy=$pid
  through caddy "$port"
  kill -TERM "$caddy"; wait "$caddy" 2>/dev/null || true
else
  missing+=(caddy)
fi
[ "${#missing[@]}" -eq 0 ] || skip "not installed: ${missing[*]} (run tools/setup all)"
