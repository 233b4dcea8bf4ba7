# SPDX-License-Identifier: MIT
# prismweb as its package installs it: it runs hardened, as a separate user, shows every gyro and never starts a stopped one.
page=prismweb.service
url=http://127.0.0.1:8467
token() { inside cat /run/prismweb/prismweb-8467.token; }
api() { inside curl -s -H "Authorization: Bearer $(token)" "$url/api/$1"; }
state_of_gyro1() { api instances | jq -r '.[] | select(.name == "gyro1") | .state'; }
if ! inside sh -c 'command -v curl' >/dev/null; then
  echo "left out: curl is not installed (tools/setup)"
else
check "prismweb's package installs" inside dpkg --install /prism-web.deb
same "the installation does not start prismweb" "$(property ActiveState "$page")" inactive
same "systemd-analyze verify prints no warnings about prismweb" "$(inside systemd-analyze verify --man=no "$page" 2>&1)" ""
check "exposure of prismweb is at most 1.5" \
  inside systemd-analyze security --offline=true --threshold=15 --no-pager "/usr/lib/systemd/system/$page"
inside systemctl start "$unit"
inside cp /usr/share/prism/examples/web.json /etc/prism/web.json
check "prismweb starts" inside systemctl enable --now "$page"
becomes 10 "prismweb reports the gyro as running" running state_of_gyro1
same "prismweb runs as a separate user" "$(inside ps -o user= -p "$(property MainPID "$page")")" prismweb
same "a request without the token is rejected" "$(inside curl -s -o /dev/null -w '%{http_code}' "$url/api/instances")" 401
contains "prismweb serves the page" "$(inside curl -s "$url/")" "<title>prism"
same "prismweb serves dygraphs" "$(inside curl -s -o /dev/null -w '%{http_code}' "$url/dygraphs/dygraph.min.js")" 200
same "name in the gyro's status" "$(api gyro1/status | jq -r .name)" gyro1
contains "prismweb serves metrics" "$(inside curl -s -H "Authorization: Bearer $(token)" "$url/metrics")" 'prism_up{gyro="gyro1"} 1'
same "only prismweb can read the token" "$(inside stat -c '%a %U' /run/prismweb/prismweb-8467.token)" "600 prismweb"
before=$(token) started=$(property MainPID "$page")
check "prismweb reloads" inside systemctl reload "$page"
same "the process is the same after the reload" "$(property ActiveState "$page") $(property MainPID "$page")" "active $started"
check "prismweb restarts" inside systemctl restart "$page"
same "the restart keeps the token" "$(token)" "$before"
inside systemctl stop "$unit" 2>/dev/null
becomes 10 "prismweb reports the gyro as stopped" stopped state_of_gyro1
sleep 3
same "prismweb does not start the gyro" "$(property ActiveState)" inactive
rights=$(inside sh -c "grep -E '^(NoNewPrivs|Seccomp|CapBnd|CapEff):' /proc/$(property MainPID "$page")/status" | awk '{print $2}' | xargs)
same "prismweb: no capabilities, no new privileges, system calls filtered" "$rights" "0000000000000000 0000000000000000 1 2"
killed=$(property MainPID "$page")
inside systemctl kill --signal=KILL "$page"
becomes 10 "systemd restarts the killed prismweb" active state_after "$killed" "$page"
inside systemctl start "$unit"
check "prismweb stops" inside systemctl stop "$page"
same "prismweb stopped without an error" "$(property Result "$page")" success
check "purge of prismweb" inside dpkg --purge prism-web
check "purge removes its configuration and data" inside test ! -e /etc/prism/web.json -a ! -e /var/lib/prismweb
inside userdel prismweb
fi
