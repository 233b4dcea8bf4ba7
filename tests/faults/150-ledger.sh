# SPDX-License-Identifier: MIT
# From two gyros' logs to PostgreSQL, with PRISM_FAULTS (10; long form: 60) faults, each at a random moment, one type after the other:
# kill -9 of the relay, of PostgreSQL or of a prismd, network cut after a random number of bytes, database disk full, server stopped.
# The long form kills relay and prismd until each was killed 30 times.
# Afterwards, without manual repair, the table has the same rows as the logs, each exactly once.
. "$(dirname "$0")/lib.sh"
. "$PRISM_SOURCE/tests/system/servers.sh"
faults=${PRISM_FAULTS:-$(long 10 60)}
server_user=postgres
if [ "$(id -u)" -eq 0 ] && mkdir "$dir/pg" && mount -t tmpfs -o size=160m tmpfs "$dir/pg" 2>/dev/null; then
  unmount() { umount -l "$dir/pg"; }
  at_exit unmount
  server_folder "$dir/pg"
else
  echo "the fault \"database disk full\" is left out: cannot mount a small file system"
fi
postgres_options="-c max_wal_size=32MB -c min_wal_size=32MB -c wal_keep_size=0"
start_postgres
frames 20
for gyro in 1 2; do
  start sim$gyro prismsim --link "$dir/tty$gyro" --frames "$dir/frames.json" --profile second --speed 20 --seed $gyro
  config
  jq ".line.device = \"$dir/tty$gyro\" | .log.directory = \"$dir/log$gyro\" | .log.segment_mib = 0.2 | .socket.path = \"$dir/gyro$gyro.sock\"" gyro.json >gyro$gyro.conf
done
port=$(free_port)
start proxy python3 "$PRISM_SOURCE/tests/faults/cutting_proxy.py" "$port" "$dir/pg/.s.PGSQL.5432" "$dir/cut"
relay_config ", \"postgresql\": {\"connection\": \"host=127.0.0.1 port=$port dbname=prism user=relay\"}"
wait_for 10 prismrelay --init relay.json
declare -A prismd_of
run_gyro() { start prismd$1 prismd "$dir/gyro$1.conf"; prismd_of[$1]=$pid; }
run_gyro 1; run_gyro 2
start_relay
RANDOM=7
rows() { sql "SELECT count(*) FROM prism.rows" 2>/dev/null || echo 0; }
grows() { local now; now=$(rows); [ "$now" -gt "$1" ]; }
wait_for 30 grows 20

run_again() { local tries=0; until try_postgres; do tries=$((tries + 1)); [ $tries -lt 20 ] || fail "PostgreSQL does not start again: $(tail -5 "$dir/pg/log")"; sleep 1; done; }
kinds=(relay postgres prismd network)
! mountpoint -q "$dir/pg" || kinds+=(disk)
kinds+=(away)
plan=()
for ((fault = 0; fault < faults; fault++)); do plan+=("${kinds[fault % ${#kinds[@]}]}"); done
declare -A count=([relay]=0 [prismd]=0)
for kind in "${plan[@]}"; do count[$kind]=$((${count[$kind]:-0} + 1)); done
for kind in relay prismd; do for ((; count[$kind] < $(long 0 30); count[$kind]++)); do plan+=($kind); done; done
for kind in "${plan[@]}"; do
  sleep "0.$((RANDOM % 900 + 100))"
  case "$kind" in
    relay) kill -9 "$relay"; wait "$relay" 2>/dev/null || true; start_relay ;;
    postgres) kill -9 "$(head -1 "$dir/pg/data/postmaster.pid")"; sleep 1; run_again ;;
    prismd) which=$((RANDOM % 2 + 1)); kill -9 "${prismd_of[$which]}"; wait "${prismd_of[$which]}" 2>/dev/null || true; run_gyro $which ;;
    network) for cut in 1 2 3; do echo $((RANDOM % 20000)) >"$dir/cut"; sleep 0.7; done ;;
    disk) head -c 200M /dev/zero 2>/dev/null | as_server tee "$dir/pg/ballast" >/dev/null 2>&1 || true; sleep "$(long 3 20)"; rm -f "$dir/pg/ballast"
      pg_isready -q -h "$dir/pg" || { sleep 1; as_server "$postgres_bin/pg_ctl" -D "$dir/pg/data" -m immediate stop >/dev/null 2>&1 || true; run_again; } ;;
    away) stop_postgres immediate; sleep "$(long 1 60)"; run_again ;;
  esac
  before=$(rows)
  wait_for 90 grows "$before"
done

# The gyros end; then the table must have each row of their logs once.
for gyro in 1 2; do kill -TERM "${prismd_of[$gyro]}"; wait "${prismd_of[$gyro]}" || fail "prismd $gyro: exit code $?"; run_gyro $gyro; done
[ ${#children[@]} -eq 0 ] || pkill -x prismsim -P $$ || true
sleep 1
for gyro in 1 2; do kill -TERM "${prismd_of[$gyro]}"; wait "${prismd_of[$gyro]}"; done
for gyro in 1 2; do jq '.line.device = "/nowhere"' gyro$gyro.conf >still.conf; mv still.conf gyro$gyro.conf; run_gyro $gyro; done
python3 "$PRISM_SOURCE/tests/faults/rows_of_logs.py" "$dir/log1" "$dir/log2" >in_logs
table() { psql -X -q -A -t -F ' ' -h "$dir/pg" -U relay prism -c "SELECT replace(log::text, '-', ''), segment, row_number, extract(epoch FROM time)::bigint, to_char(rate_deg_per_h, 'FM999999990.000000'), to_char(temperature_degc, 'FM999990.00000'), quality FROM prism.rows ORDER BY log::text, segment, row_number"; }
alike() { table >in_table && cmp -s in_logs in_table; }
deadline=$(($(date +%s) + 120))
until alike; do [ "$(date +%s)" -lt "$deadline" ] || fail "$(wc -l <in_logs) rows in the logs, $(wc -l <in_table) in the table: $(diff in_logs in_table | head -5)"; sleep 0.5; done
same "gaps: rows deleted before the relay sent them" "$(sql "SELECT count(*) FROM prism.gaps")" 0
same "rejected rows" "$(sql "SELECT count(*) FROM prism.refused_rows")" 0
echo "${#plan[@]} faults ($(for kind in "${kinds[@]}"; do echo "$kind ${count[$kind]:-0}"; done | paste -sd, -)): $(wc -l <in_table) rows, each once, the same in logs and table ($(sha256sum <in_table | cut -c1-16))"
