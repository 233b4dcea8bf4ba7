# SPDX-License-Identifier: MIT
# The page as packages install it: a user of its own, hardened, that shows every gyro and starts none that somebody stopped.
page=prismweb.service
url=http://127.0.0.1:8467
token() { inside cat /run/prismweb/prismweb-8467.token; }
api() { inside curl -s -H "Authorization: Bearer $(token)" "$url/api/$1"; }
state_of_gyro1() { api instances | jq -r '.[] | select(.name == "gyro1") | .state'; }
if ! inside sh -c 'command -v curl' >/dev/null; then
  echo "left out: curl is not installed here (tools/setup)"
else
check "the package of the page installs" inside dpkg --install /prism-web.deb
same "nothing is started by its installation" "$(property ActiveState "$page")" inactive
same "systemd-analyze verify says nothing of the page" "$(inside systemd-analyze verify --man=no "$page" 2>&1)" ""
check "its exposure is 1.5 at most, too" inside systemd-analyze security --offline=true --threshold=15 --no-pager "/usr/lib/systemd/system/$page"
inside systemctl start "$unit"
inside cp /usr/share/prism/examples/web.json /etc/prism/web.json
check "the page starts" inside systemctl enable --now "$page"
becomes 10 "it sees the gyro" running state_of_gyro1
same "it runs as a user of its own" "$(inside ps -o user= -p "$(property MainPID "$page")")" prismweb
same "without the token nothing is told" "$(inside curl -s -o /dev/null -w '%{http_code}' "$url/api/instances")" 401
contains "the page itself" "$(inside curl -s "$url/")" "<title>prism"
same "dygraphs is there" "$(inside curl -s -o /dev/null -w '%{http_code}' "$url/dygraphs/dygraph.min.js")" 200
same "what the gyro says" "$(api gyro1/status | jq -r .name)" gyro1
contains "metrics" "$(inside curl -s -H "Authorization: Bearer $(token)" "$url/metrics")" 'prism_up{gyro="gyro1"} 1'
same "the token is nobody else's" "$(inside stat -c '%a %U' /run/prismweb/prismweb-8467.token)" "600 prismweb"
before=$(token) started=$(property MainPID "$page")
check "it reloads" inside systemctl reload "$page"
same "and goes on" "$(property ActiveState "$page") $(property MainPID "$page")" "active $started"
check "it restarts" inside systemctl restart "$page"
same "with the same token" "$(token)" "$before"
inside systemctl stop "$unit" 2>/dev/null
becomes 10 "it sees that somebody stopped the gyro" stopped state_of_gyro1
sleep 3
same "and lets it rest" "$(property ActiveState)" inactive
rights=$(inside sh -c "grep -E '^(NoNewPrivs|Seccomp|CapBnd|CapEff):' /proc/$(property MainPID "$page")/status" | awk '{print $2}' | xargs)
same "no capabilities, no new privileges, system calls filtered, of the page" "$rights" "0000000000000000 0000000000000000 1 2"
inside systemctl kill --signal=KILL "$page"
becomes 10 "killed, the page comes again" active property ActiveState "$page"
inside systemctl start "$unit"
check "the page stops" inside systemctl stop "$page"
same "and well" "$(property Result "$page")" success
check "purge of the page" inside dpkg --purge prism-web
check "and what it kept is gone" inside test ! -e /etc/prism/web.json -a ! -e /var/lib/prismweb
inside userdel prismweb
fi
