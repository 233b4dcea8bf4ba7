# SPDX-License-Identifier: MIT
# The relay as docs/fleet.md has it installed: a user of its own that PostgreSQL knows by name, hardened, and one that starts no gyro that
# somebody stopped.
relay=prismrelay.service
fleet_page=$here/../../docs/fleet.md
ledger() { inside runuser -u postgres -- psql -X -q -A -t prism -c "$1" 2>&1; }
# documented COMMAND: as the page has it, word for word; it succeeds.
documented() {
  contains "the page has: $1" "$(cat "$fleet_page")" "    $1"
  check "and it works" inside sh -c "$1"
}
relay_says() { inside prismrelay --status --json 2>/dev/null | jq -r "$1"; }
ledger_has_more_than() { [ "$(ledger 'SELECT count(*) FROM prism.rows')" -gt "$1" ] && echo yes; }
if ! inside sh -c 'ls -d /usr/lib/postgresql/*/bin && command -v mosquitto mosquitto_sub prometheus-node-exporter' >/dev/null 2>&1; then
  echo "left out: not all of PostgreSQL, mosquitto and node_exporter are installed here (tools/setup)"
else
check "the package installs" inside dpkg --install /prism-relay.deb
check "its user is made" inside getent passwd prismrelay
contains "and is in the group that may ask" "$(inside id -nG prismrelay)" prism
same "nothing is started by the installation" "$(property ActiveState "$relay")" inactive
same "systemd-analyze verify says nothing of the relay" "$(inside systemd-analyze verify --man=no "$relay" 2>&1)" ""
check "its exposure is 1.5 at most" inside systemd-analyze security --offline=true --threshold=15 --no-pager /usr/lib/systemd/system/prismrelay.service
same "the passwords' folder is root's alone" "$(inside stat -c '%A %U' /etc/prism/credentials)" "drwx------ root"

version=$(inside sh -c 'ls /usr/lib/postgresql | sort -n | tail -1')
inside sh -c "pg_lsclusters -h | grep -q main || pg_createcluster $version main" >/dev/null
check "PostgreSQL runs" inside systemctl start "postgresql@$version-main"
check "mosquitto and node_exporter run" inside systemctl start mosquitto prometheus-node-exporter
documented "su postgres -c 'createuser prismrelay && createdb -O prismrelay prism'"
awk '/^    \{$/ {on = 1} on {print substr($0, 5)} /^    \}$/ {exit}' "$fleet_page" >"$box/relay.json"
inside sh -c 'cat >/etc/prism/relay.json' <"$box/relay.json"
documented "prismrelay --check"
documented "runuser -u prismrelay -- prismrelay --init"

# Somebody stops the gyro: systemd listens on, and the relay lets it rest.
inside systemctl stop "$unit" 2>/dev/null
documented "systemctl enable --now prismrelay"
becomes 10 "it sees the gyro that was stopped" stopped relay_says '.instances["lab1/gyro1"].state'
becomes 20 "the metrics are there" 0 exit_code inside test -e /run/prismrelay/prism.prom
same "and does not start it" "$(property ActiveState)" inactive
contains "metrics of a stopped gyro" "$(inside cat /run/prismrelay/prism.prom)" 'prism_up{gyro="lab1/gyro1"} 0'
inside systemctl start "$unit"
becomes 15 "started, it is followed" running relay_says '.instances["lab1/gyro1"].state'
becomes 20 "its rows are in the ledger" yes ledger_has_more_than 2
documented "prismrelay --status"
documented "su postgres -c \"psql prism -c 'SELECT gyro, axis, arrival, corrected_deg_per_h, quality FROM prism.latest'\""
documented "mosquitto_sub -t 'prism/lab1/+/+/status' -C 1"
documented "ln -s /run/prismrelay/prism.prom /var/lib/prometheus/node-exporter/prism.prom"
becomes 20 "the metrics are made anew" 0 exit_code inside grep -q prism_line_receiving /run/prismrelay/prism.prom
documented "curl -s localhost:9100/metrics | grep prism_line_receiving"
same "each once" "$(ledger 'SELECT count(*) - count(DISTINCT (log, segment, row_number)) FROM prism.rows')" 0
contains "systemd is told" "$(property StatusText "$relay")" " gyros run; mqtt: up; postgresql: up"
inside systemctl stop "$unit" 2>/dev/null
sleep 16   # the metrics' own pace
same "stopped while it was followed, it rests, too" "$(property ActiveState)" inactive
contains "what the metrics say then" "$(inside cat /run/prismrelay/prism.prom)" 'prism_up{gyro="lab1/gyro1"} 0'
rights=$(inside sh -c "grep -E '^(NoNewPrivs|Seccomp|CapBnd|CapEff):' /proc/$(property MainPID "$relay")/status" | awk '{print $2}' | xargs)
same "no capabilities, no new privileges, system calls filtered, of the relay" "$rights" "0000000000000000 0000000000000000 1 2"
inside systemctl kill --signal=STOP "$relay"
inside systemctl kill --signal=CONT "$relay"
inside systemctl kill --signal=KILL "$relay"
becomes 10 "killed, it comes again" active property ActiveState "$relay"
inside systemctl start "$unit"
before=$(ledger 'SELECT count(*) FROM prism.rows')
becomes 20 "and goes on" yes ledger_has_more_than "$before"
check "it stops" inside systemctl stop "$relay"
same "well" "$(property Result "$relay")" success
check "purge of the relay" inside dpkg --purge prism-relay
check "and its configuration is gone" inside test ! -e /etc/prism/relay.json -a ! -e /etc/prism/credentials
inside userdel prismrelay   # sysusers leaves users, as files may carry their number
inside rm -f /var/lib/prometheus/node-exporter/prism.prom
inside systemctl stop mosquitto prometheus-node-exporter "postgresql@$version-main"
fi
