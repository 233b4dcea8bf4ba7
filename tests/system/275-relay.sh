# SPDX-License-Identifier: MIT
# prismrelay with a real PostgreSQL: the database gets every row of the log once, across restarts of the server, a deleted log and
# invalid lines. A missing or newer schema is reported.
. "$(dirname "$0")/lib.sh"
. "$PRISM_SOURCE/tests/system/servers.sh"
refused() { code=0; "${@:3}" 2>refused.err >/dev/null || code=$?; same "exit code: $2" "$code" "$1"; contains "the error" "$(cat refused.err)" "$2"; same "lines of the error: $2" "$(wc -l <refused.err)" 1; }
bad_config() { echo "$1" >bad.json; refused 78 "$2" prismrelay --check bad.json; }

# A configuration error is reported in one line at the start.
bad_config '{"postgresql": {"connection": "dbname=x"}}' '"site" is missing'
bad_config '{"site": "a/b", "postgresql": {"connection": "dbname=x"}}' 'found "a/b", expected 1 to 64 printable characters without blanks, /, + and #'
bad_config '{"site": "lab"}' 'has no target, expected postgresql or mqtt'
bad_config '{"site": "lab", "postgresql": {"connection": "dbname=x password=y"}}' 'contains a password; put it in the file named by password_file'
bad_config '{"site": "lab", "mqtt": {"host": "h", "portt": 1}}' 'portt'
bad_config '{"site": "lab", "instances": ["g", "/x/g.sock"], "mqtt": {"host": "h"}}' 'found "g" twice'
echo '{"site": "lab", "status_file": "/nowhere/x", "mqtt": {"host": "h"}}' >nowhere.json
refused 1 'cannot read the status; is prismrelay running?' prismrelay --status nowhere.json
refused 64 '--what' prismrelay --what

start_postgres
relay_config
config
jq '.log.segment_mib = 0.01 | .clock = "device"' gyro.json >small.json && mv small.json gyro.json
frames 50
start_sim --profile steady --speed 5
start_prismd
rows_of_log() { grep -hv '^[#t]' log/gyro-*.csv; }
all_there() { sql_is "SELECT count(*) FROM prism.rows" "$(rows_of_log | wc -l)"; }

# A missing schema and one of a later version are reported; the relay retries until the schema is right.
start_relay
wait_for 10 relay_is .targets.postgresql.error 'postgresql: has no schema prism; create it with prismrelay --init'
kill -STOP "$relay"  # so that it retries only after both changes
prismrelay --schema | psql -X -q -v ON_ERROR_STOP=1 -h "$dir/pg" -U relay prism >schema.out 2>&1 || fail "the SQL of --schema: $(cat schema.out)"
sql 'UPDATE prism.version SET version = 3'
kill -CONT "$relay"
wait_for 20 relay_is .targets.postgresql.error 'postgresql: found version 3 of the schema prism, expected 2: created by a later prismrelay'
refused 1 'found version 3 of the schema prism' prismrelay --init relay.json
sql 'DROP SCHEMA prism CASCADE' 2>/dev/null
contains "a new schema" "$(prismrelay --init relay.json)" "created schema prism, version 2"
contains "an existing schema" "$(prismrelay --init relay.json)" "schema prism exists"
wait_for 30 sql_above "SELECT count(*) FROM prism.rows" 20
wait_for 10 relay_is '.logs[0] | "\(.gyro) \(.axis) \(.refused_rows) \(.missing_rows) \(.error)"' "lab/gyro z 0 0 "
contains "human-readable status" "$(prismrelay --status relay.json)" "lab/gyro                running"
same "events" "$(sql "SELECT count(*) > 1, bool_or(kind = 'line_receiving') FROM prism.events WHERE gyro = 'lab/gyro'")" "t|t"
same "the model of a segment" "$(sql "SELECT DISTINCT left(model, 8) || ' ' || (metadata ->> 'instance') FROM prism.segments")" "a0e547ce gyro"

# The server stops for some seconds and the relay is killed: no row is lost or duplicated (compared below).
stop_postgres immediate
wait_for 15 relay_is .targets.postgresql.up false
kill -9 "$relay"; wait "$relay" 2>/dev/null || true
start_relay
run_postgres
wait_for 30 relay_is .targets.postgresql.up true
before=$(sql "SELECT count(*) FROM prism.rows")
wait_for 20 sql_above "SELECT count(*) FROM prism.rows" $((before + 20))

# The server becomes read-only: the relay reports it, and continues when the server can write again.
sql "ALTER ROLE relay SET default_transaction_read_only = on"
sql "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE application_name = 'prismrelay'" >/dev/null
wait_for 20 relay_is '.targets.postgresql.error | test("read-only")' true
psql -X -q -h "$dir/pg" -U relay prism -c "SET default_transaction_read_only = off" -c "ALTER ROLE relay RESET default_transaction_read_only"
wait_for 40 relay_is .targets.postgresql.up true

# The database is replaced by an older copy while a request is pending: the rows after its cursor are sent again (compared below).
sql "DELETE FROM prism.rows; UPDATE prism.places SET cursor = 'earliest'; SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE application_name = 'prismrelay'" >/dev/null
wait_for 20 sql_above "SELECT count(*) FROM prism.rows" 20

# prismd is killed and started again: the relay reports the states gone and running.
kill -9 "$prismd"; wait "$prismd" 2>/dev/null || true
wait_for 10 relay_is '.instances["lab/gyro"].state' gone
start_prismd
wait_for 15 relay_is '.instances["lab/gyro"].state' running

# An invalid line in a segment is stored unchanged in refused_rows and does not block the rows after it.
kill -TERM "$prismd"; wait "$prismd"
last=$(ls log | tail -1)
kill -STOP "$relay"
start_prismd
wait_for 10 field_above .log.rows status 10
kill -9 "$prismd"; wait "$prismd" 2>/dev/null || true
last=$(ls log | tail -1)
sed -i '$s/,[a-z_+]*,\([^,]*,[^,]*,[^,]*,[^,]*,[01]\)$/,Robert"); DROP TABLE,\1/' "log/$last"
grep -q Robert "log/$last" || fail "the line was not changed: $(tail -1 "log/$last")"
kill -CONT "$relay"
start_prismd
wait_for 20 sql_is "SELECT count(*) || ' ' || min(why) FROM prism.refused_rows" '1 column quality: found "Robert"); DROP TABLE", expected a valid value'
sql "SELECT line FROM prism.refused_rows" >line
grep -qxF "$(cat line)" "log/$last" || fail "the line in refused_rows differs from that of the log"

# Compare the log with the table: every row once, with all values.
kill -TERM "$sim"; wait "$sim" 2>/dev/null || true
wait_for 5 field_is .state status connecting
kill -TERM "$prismd"; wait "$prismd"
start_prismd
wait_for 20 sql_is "SELECT count(*) FROM prism.rows" "$(($(rows_of_log | wc -l) - 1))"
cat >compare.py <<'END'
import csv, sys
number = lambda text: text if text and not text[0].isdigit() and text[0] != "-" else (float(text) if text else None)
names = "time_s,samples,missing,rate_deg_per_h,temperature_degc,uhfo_v,status,mean_rate_deg_per_h,slope_degc_per_s,bias_deg_per_h,sd_deg_per_h,corrected_deg_per_h,quality,arrival_s,sent_deg_per_h,partial".split(",")
log = [[number(row[name]) for name in names] for row in csv.DictReader(open("log.csv")) if "Robert" not in row["quality"]]
table = [[number(row[name]) for name in names] for row in csv.DictReader(open("table.csv"))]
for mine, theirs in zip(log, table):
    if any(a != b and not (isinstance(a, float) and isinstance(b, float) and abs(a - b) < 1e-5 * max(1, abs(a) * 1e-9)) for a, b in zip(mine, theirs)):
        sys.exit(f"found {theirs}, expected {mine}")
sys.exit(0 if len(log) == len(table) > 50 else f"found {len(table)} rows, expected {len(log)}")
END
first=$(ls log | head -1)
{ grep -m1 ^time_utc "log/$first"; rows_of_log; } >log.csv
psql -X -q --csv -h "$dir/pg" -U relay prism -c "SELECT *, extract(epoch FROM time) AS time_s, extract(epoch FROM arrival) AS arrival_s FROM prism.rows ORDER BY segment, row_number" >table.csv
python3 compare.py || fail "the table differs from the log"

# The log directory is deleted: a new log begins, the old rows stay in the table, and the change is recorded.
kill -TERM "$prismd"; wait "$prismd"
old=$(sql "SELECT count(*) FROM prism.rows")
rm -rf log
start_sim --profile steady --speed 5
start_prismd
wait_for 20 sql_is "SELECT kind FROM prism.gaps" log_changed
wait_for 20 sql_above "SELECT count(*) FROM prism.rows" $((old + 10))
same "logs in the table" "$(sql "SELECT count(DISTINCT log) FROM prism.rows")" 2
same "the latest row of each gyro" "$(sql "SELECT gyro || ' ' || axis || ' ' || (arrival > now() - interval '10 s') FROM prism.latest")" "lab/gyro z true"
same "hours" "$(sql "SELECT sum(seconds) >= $old FROM prism.hourly")" t

# Partitions are created in advance, and dropped after keep_days with a message.
same "partitions" "$(sql "SELECT count(*) > 2 FROM prism.days")" t
kill -TERM "$relay"; wait "$relay" || fail "exit code $? of the relay after SIGTERM"
sql "CREATE TABLE prism.rows_20200101 PARTITION OF prism.rows FOR VALUES FROM ('2020-01-01 00:00:00+00') TO ('2020-01-02 00:00:00+00')"
jq '.postgresql.keep_days = 30' relay.json >kept.json && mv kept.json relay.json
start_relay
wait_for 15 sql_is "SELECT count(*) FROM prism.days WHERE day < '2021-01-01'" 0
contains "message of a dropped partition" "$(cat relay.err)" "dropped rows_20200101"

# Texts that SQL, CSV or JSON may interpret: the rows of each gyro arrive; only invalid rows and an invalid name are reported.
hostile='a\u0000b'"'"'; DROP TABLE prism.rows;--"'
jq --arg text "$hostile" '.name = $text' "$PRISM_SOURCE/config/models/tao2019-model2.json" >model.json
jq --arg text "$hostile" ".gyro.serial = \$text | .model = \"$dir/model.json\" | .line.device = \"$dir/tty2\" | .log.directory = \"$dir/log2\" | .socket.path = \"$dir/second.sock\"" gyro.json >second.json
start sim2 prismsim --link "$dir/tty2" --frames "$dir/frames.json" --profile steady --speed 5
start second prismd second.json
start_hostile hostile
start_hostile unreadable unreadable
touch "$dir/"$'\xff.sock'
wait_for 20 sql_above "SELECT count(*) FROM prism.rows WHERE gyro = 'lab/second'" 5
same "the serial number" "$(sql "SELECT DISTINCT metadata ->> 'gyro_serial' FROM prism.segments WHERE gyro = 'lab/second'")" "$hostile"
same "the model's name" "$(sql "SELECT DISTINCT right(model, ${#hostile}) FROM prism.segments WHERE gyro = 'lab/second'")" "$hostile"
wait_for 20 sql_is "SELECT count(*) FROM prism.rows WHERE gyro = 'lab/hostile'" 4
same "NUL and the end marker of COPY" "$(sql "SELECT count(*) FROM prism.segments WHERE gyro = 'lab/hostile' AND metadata ->> 'model' LIKE E'a\\\\\\\\u0000b\uFFFDc%\\n\\\\\\\\.\\n%'")" 1
same "an event" "$(sql "SELECT count(*) FROM prism.events WHERE gyro = 'lab/hostile' AND kind = text AND text LIKE '%DROP TABLE%'")" 1
log_is() { relay_is ".logs[] | select(.gyro == \"lab/$1\") | \"\(.rows > 0) \(.caught_up) \(.refused_rows) \(.error | test(\"no valid row\"))\"" "$2"; }
wait_for 20 log_is unreadable "false false 4 true"
wait_for 20 log_is hostile "true true 1 false"
prismrelay --status relay.json >status.txt
contains "human-readable status" "$(cat status.txt)" "axis z: 0 rows, not sending, 4 invalid lines: no valid row; last error: "
contains "human-readable status" "$(cat status.txt)" "axis z: 4 rows, up to date, 1 invalid line"
before=$(sql "SELECT count(*) FROM prism.rows WHERE gyro = 'lab/gyro'")
wait_for 20 sql_above "SELECT count(*) FROM prism.rows WHERE gyro = 'lab/gyro'" "$before"
same "messages about the invalid name" "$(grep -c 'xff.sock: skipped' relay.err)" 1
prismrelay --status relay.json >status.txt; prismrelay --status --json relay.json >status.out
for file in relay.err status.txt status.out; do is_printable "$file" || fail "$file is not printable"; done

# A server that does not respond is reported; the relay waits for it, and SIGTERM ends the relay nevertheless.
frozen=$(sql "SELECT pid FROM pg_stat_activity WHERE application_name = 'prismrelay'")
kill -STOP "$frozen"
wait_for 40 relay_is '.targets.postgresql | "\(.up) \(.error)"' "false postgresql: no response for 20 s"
kill -TERM "$relay"; wait "$relay" || fail "exit code $? while the server does not respond"
kill -CONT "$frozen"
start_relay
before=$(sql "SELECT count(*) FROM prism.rows WHERE gyro = 'lab/second'")
wait_for 20 sql_above "SELECT count(*) FROM prism.rows WHERE gyro = 'lab/second'" "$before"
