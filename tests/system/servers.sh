# SPDX-License-Identifier: MIT
# Real servers in the test's directory, on Unix sockets and loopback only. Source it after lib.sh.

# If root runs the test, servers run as $server_user, because PostgreSQL does not run as root.
as_server() { if [ "$(id -u)" -eq 0 ]; then runuser -u "$server_user" -- "$@"; else "$@"; fi; }
server_folder() {
  mkdir -p "$1"
  [ "$(id -u)" -ne 0 ] || { chmod 711 "$dir" && chown "$server_user" "$1"; }
}

# needs_mosquitto: prepares for a broker on $port, or skips the test.
needs_mosquitto() {
  PATH=$PATH:/usr/sbin
  command -v mosquitto mosquitto_sub >"$dir/programs" || skip "mosquitto is not installed (run tools/setup all)"
  server_user=mosquitto
  port=$(free_port)
}

# start_postgres: runs a server on $dir/pg with database prism of user relay. sql STATEMENT: runs a statement and prints the result.
# stop_postgres [MODE]: smart, fast or immediate.
start_postgres() {
  server_user=postgres
  postgres_bin=$(ls -d /usr/lib/postgresql/*/bin 2>/dev/null | tail -1)
  [ -n "$postgres_bin" ] || skip "PostgreSQL is not installed (run tools/setup all)"
  if [ ! -d "$dir/pg/data" ]; then
    server_folder "$dir/pg"
    as_server "$postgres_bin/initdb" -D "$dir/pg/data" -A trust -U relay --no-sync -E UTF8 --locale=C >"$dir/initdb.out" 2>&1 || fail "initdb: $(tail -3 "$dir/initdb.out")"
    at_exit kill_postgres
  fi
  run_postgres
  as_server "$postgres_bin/createdb" -h "$dir/pg" -U relay prism
}
try_postgres() { as_server "$postgres_bin/pg_ctl" -D "$dir/pg/data" -w -t 60 -l "$dir/pg/log" -o "-k $dir/pg -c listen_addresses='' -c fsync=${postgres_fsync:-off} ${postgres_options:-}" start >/dev/null 2>&1; }
run_postgres() { try_postgres || fail "PostgreSQL: $(tail -5 "$dir/pg/log")"; }
kill_postgres() { stop_postgres immediate; }
stop_postgres() { as_server "$postgres_bin/pg_ctl" -D "$dir/pg/data" -m "${1:-fast}" -w stop >/dev/null 2>&1; }
sql() { psql -X -q -A -t -v ON_ERROR_STOP=1 -h "$dir/pg" -U relay prism -c "$1"; }
sql_is() { [ "$(sql "$1" 2>&1)" = "$2" ]; }
sql_above() { [ "$(sql "$1" 2>/dev/null || echo 0)" -gt "$2" ]; }

# relay_config [MEMBERS]: writes $dir/relay.json for the sockets in $dir. MEMBERS name the targets; default: the server of start_postgres.
relay_config() {
  local members=${1:-}
  [ -n "$members" ] || members=", \"postgresql\": {\"connection\": \"host=$dir/pg dbname=prism user=relay\"}"
  echo "{\"site\": \"lab\", \"instances\": \"$dir/\", \"status_file\": \"status.json\" $members}" >"$dir/relay.json"
}
start_relay() { start relay prismrelay "$dir/relay.json"; relay=$pid; }
relay_says() { prismrelay --status --json "$dir/relay.json" | jq -r "$1"; }
relay_is() { [ "$(relay_says "$1")" = "$2" ]; }
