# SPDX-License-Identifier: MIT
# The relay as docs/fleet.md has it installed: a user of its own that PostgreSQL knows by name, hardened, and one that starts no gyro that
# somebody stopped.
relay=prismrelay.service
ledger() { inside runuser -u postgres -- psql -X -q -A -t -h /run/ledger prism -c "$1" 2>&1; }
relay_says() { inside prismrelay --status --json 2>/dev/null | jq -r "$1"; }
ledger_has_more_than() { [ "$(ledger 'SELECT count(*) FROM prism.rows')" -gt "$1" ] && echo yes; }
if ! inside sh -c 'ls -d /usr/lib/postgresql/*/bin' >/dev/null 2>&1; then
  echo "left out: no PostgreSQL is installed here (tools/setup)"
else
check "the package installs" inside dpkg --install /prism-relay.deb
check "its user is made" inside getent passwd prismrelay
contains "and is in the group that may ask" "$(inside id -nG prismrelay)" prism
same "nothing is started by the installation" "$(property ActiveState "$relay")" inactive
same "systemd-analyze verify says nothing of the relay" "$(inside systemd-analyze verify --man=no "$relay" 2>&1)" ""
check "its exposure is 1.5 at most" inside systemd-analyze security --offline=true --threshold=15 --no-pager /usr/lib/systemd/system/prismrelay.service
same "the passwords' folder is root's alone" "$(inside stat -c '%A %U' /etc/prism/credentials)" "drwx------ root"

inside sh -c 'bin=$(ls -d /usr/lib/postgresql/*/bin | tail -1) && install -d -o postgres /run/ledger /var/tmp/ledger &&
  runuser -u postgres -- "$bin/initdb" -D /var/tmp/ledger -A peer --no-sync >/dev/null &&
  runuser -u postgres -- "$bin/pg_ctl" -D /var/tmp/ledger -w -o "-k /run/ledger -c listen_addresses= -c fsync=off" -l /var/tmp/ledger/log start >/dev/null &&
  runuser -u postgres -- createuser -h /run/ledger prismrelay && runuser -u postgres -- createdb -h /run/ledger -O prismrelay prism'
inside sh -c 'cat >/etc/prism/relay.json' <<<'{"site": "lab", "postgresql": {"connection": "host=/run/ledger dbname=prism"}, "metrics": {"file": "/run/prismrelay/prism.prom", "every_s": 1}}'
contains "the tables are made by its own user" "$(inside runuser -u prismrelay -- prismrelay --init 2>&1)" "made the schema prism"

# Somebody stops the gyro: systemd listens on, and the relay lets it rest.
inside systemctl stop "$unit" 2>/dev/null
check "the relay starts" inside systemctl enable --now "$relay"
becomes 10 "it sees the gyro that was stopped" stopped relay_says '.instances["lab/gyro1"].state'
sleep 4
same "and does not start it" "$(property ActiveState)" inactive
contains "metrics of a stopped gyro" "$(inside cat /run/prismrelay/prism.prom)" 'prism_up{gyro="lab/gyro1"} 0'
inside systemctl start "$unit"
becomes 15 "started, it is followed" running relay_says '.instances["lab/gyro1"].state'
becomes 20 "its rows are in the ledger" yes ledger_has_more_than 2
same "each once" "$(ledger 'SELECT count(*) - count(DISTINCT (log, segment, row_number)) FROM prism.rows')" 0
contains "systemd is told" "$(property StatusText "$relay")" " gyros run; postgresql: up"
inside systemctl stop "$unit" 2>/dev/null
sleep 3
same "stopped while it was followed, it rests, too" "$(property ActiveState)" inactive
contains "what the metrics say then" "$(inside cat /run/prismrelay/prism.prom)" 'prism_up{gyro="lab/gyro1"} 0'
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
inside sh -c 'runuser -u postgres -- "$(ls -d /usr/lib/postgresql/*/bin | tail -1)/pg_ctl" -D /var/tmp/ledger -m immediate stop >/dev/null; rm -rf /var/tmp/ledger /run/ledger'
fi
