# SPDX-License-Identifier: MIT
# The relay, installed as in docs/fleet.md: it runs hardened, as a separate user whom PostgreSQL knows by name, and never starts a
# stopped gyro.
relay=prismrelay.service
fleet_page=$here/../../docs/fleet.md
ledger() { inside runuser -u postgres -- psql -X -q -A -t prism -c "$1" 2>&1; }
# documented COMMAND: checks that the page contains the command literally, and that it succeeds.
documented() {
  contains "docs/fleet.md has: $1" "$(cat "$fleet_page")" "    $1"
  check "this command succeeds" inside sh -c "$1"
}
relay_says() { inside prismrelay --status --json 2>/dev/null | jq -r "$1"; }
ledger_has_more_than() { [ "$(ledger 'SELECT count(*) FROM prism.rows')" -gt "$1" ] && echo yes; }
if ! inside sh -c 'ls -d /usr/lib/postgresql/*/bin && command -v mosquitto mosquitto_sub prometheus-node-exporter' >/dev/null 2>&1; then
  echo "left out: PostgreSQL, mosquitto or node_exporter is not installed (tools/setup all)"
else
check "the relay's package installs" inside dpkg --install /prism-relay.deb
check "its user is created" inside getent passwd prismrelay
contains "its user is in the group that may connect to prismd" "$(inside id -nG prismrelay)" prism
same "the installation does not start the relay" "$(property ActiveState "$relay")" inactive
same "systemd-analyze verify prints no warnings about the relay" "$(inside systemd-analyze verify --man=no "$relay" 2>&1)" ""
check "exposure of the relay is at most 1.5" \
  inside systemd-analyze security --offline=true --threshold=15 --no-pager /usr/lib/systemd/system/prismrelay.service
same "only root can read the directory of the passwords" "$(inside stat -c '%A %U' /etc/prism/credentials)" "drwx------ root"

version=$(inside sh -c 'ls /usr/lib/postgresql | sort -n | tail -1')
inside sh -c "pg_lsclusters -h | grep -q main || pg_createcluster $version main" >/dev/null
check "PostgreSQL runs" inside systemctl start "postgresql@$version-main"
check "mosquitto and node_exporter run" inside systemctl start mosquitto prometheus-node-exporter
documented "su postgres -c 'createuser prismrelay && createdb -O prismrelay prism'"
awk '/^    \{$/ {on = 1} on {print substr($0, 5)} /^    \}$/ {exit}' "$fleet_page" >"$box/relay.json"
inside sh -c 'cat >/etc/prism/relay.json' <"$box/relay.json"
documented "prismrelay --check"
documented "runuser -u prismrelay -- prismrelay --init"

# The gyro is stopped while systemd still listens: the relay must not connect to its socket.
inside systemctl stop "$unit" 2>/dev/null
documented "systemctl enable --now prismrelay"
becomes 10 "the relay reports the gyro as stopped" stopped relay_says '.instances["lab1/gyro1"].state'
same "the relay does not start the gyro" "$(property ActiveState)" inactive
inside systemctl start "$unit"
becomes 15 "the relay reports a started gyro as running" running relay_says '.instances["lab1/gyro1"].state'
becomes 20 "its rows are in the database" yes ledger_has_more_than 2
documented "prismrelay --status"
documented "su postgres -c \"psql prism -c 'SELECT gyro, axis, arrival, corrected_deg_per_h, quality FROM prism.latest'\""
documented "mosquitto_sub -t 'prism/lab1/+/+/status' -C 1"
prom=/var/lib/prometheus/node-exporter/prism.prom
documented "printf '[Service]\\nType=oneshot\\nExecStart=prismctl metrics --file $prom\\n' >/etc/systemd/system/prism-metrics.service"
documented "printf '[Timer]\\nOnActiveSec=1s\\nOnUnitActiveSec=15s\\nAccuracySec=1s\\n[Install]\\nWantedBy=timers.target\\n' >/etc/systemd/system/prism-metrics.timer"
documented "systemctl enable --now prism-metrics.timer"
becomes 20 "the timer writes the metrics" 0 exit_code inside grep -q prism_line_receiving $prom
contains "the metrics have the relay" "$(inside cat $prom)" 'prism_relay_target_up{site="lab1",target="postgresql"} 1'
documented "curl -s localhost:9100/metrics | grep prism_line_receiving"
same "each row is in the database once" "$(ledger 'SELECT count(*) - count(DISTINCT (log, segment, row_number)) FROM prism.rows')" 0
contains "the relay reports its status to systemd" "$(property StatusText "$relay")" " gyros run; mqtt: up; postgresql: up"
inside systemctl stop "$unit" 2>/dev/null
sleep 16   # longer than the timer's interval
same "a gyro that is stopped later is not started either" "$(property ActiveState)" inactive
contains "the metrics show this gyro as stopped" "$(inside cat $prom)" 'prism_up{gyro="gyro1"} 0'
rights=$(inside sh -c "grep -E '^(NoNewPrivs|Seccomp|CapBnd|CapEff):' /proc/$(property MainPID "$relay")/status" | awk '{print $2}' | xargs)
same "the relay: no capabilities, no new privileges, system calls filtered" "$rights" "0000000000000000 0000000000000000 1 2"
inside systemctl kill --signal=STOP "$relay"
inside systemctl kill --signal=CONT "$relay"
killed=$(property MainPID "$relay")
inside systemctl kill --signal=KILL "$relay"
becomes 10 "systemd restarts the killed relay" active state_after "$killed" "$relay"
inside systemctl start "$unit"
before=$(ledger 'SELECT count(*) FROM prism.rows')
becomes 20 "the restarted relay sends rows" yes ledger_has_more_than "$before"
check "the relay stops" inside systemctl stop "$relay"
same "the relay stopped without an error" "$(property Result "$relay")" success
becomes 30 "the metrics show the stopped relay" 0 exit_code inside grep -q 'prism_relay_up{site="lab1"} 0' $prom
check "purge of the relay" inside dpkg --purge prism-relay
check "purge removes the relay's configuration" inside test ! -e /etc/prism/relay.json -a ! -e /etc/prism/credentials
inside userdel prismrelay   # purge keeps the user, because files may have its ID
inside systemctl disable --now prism-metrics.timer 2>/dev/null
inside rm -f $prom /etc/systemd/system/prism-metrics.service /etc/systemd/system/prism-metrics.timer
inside systemctl stop mosquitto prometheus-node-exporter "postgresql@$version-main"
fi
