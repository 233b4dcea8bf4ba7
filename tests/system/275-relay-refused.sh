# SPDX-License-Identifier: MIT
# Rows that PostgreSQL refuses, together with good gyros: the good rows are stored, the bad ones are in refused_rows. Before, the first bad row
# stopped all gyros of the host, while the status was "up". A batch that is refused for another reason is tried at growing intervals.
. "$(dirname "$0")/lib.sh"
. "$PRISM_SOURCE/tests/system/servers.sh"
start_postgres
relay_config
prismrelay --init relay.json >/dev/null
gyro() { start "$1" python3 "$PRISM_SOURCE/tests/system/poisoned_prismd.py" "$dir/$1.sock" "${@:2}"; wait_for 10 test -S "$dir/$1.sock"; }
rows_of() { sql "SELECT count(*) FROM prism.rows WHERE gyro = 'lab/$1'"; }
grow() { for gyro in "$@"; do local now; now=$(rows_of "$gyro"); wait_for 15 sql_above "SELECT count(*) FROM prism.rows WHERE gyro = 'lab/$gyro'" $((now + 3)); done; }

# The server refuses some rows of two logs: by a constraint, by a data error of a trigger.
sql "ALTER TABLE prism.rows ADD CONSTRAINT no_sevens CHECK (gyro <> 'lab/bad' OR samples NOT IN (7, 777, 1500))
"
sql "CREATE FUNCTION prism.check_row() RETURNS trigger LANGUAGE plpgsql AS \$\$ BEGIN
  IF NEW.gyro = 'lab/worse' AND NEW.samples % 10 = 3 THEN RAISE EXCEPTION 'the value is out of range' USING ERRCODE = '22003'; END IF; RETURN NEW; END \$\$;
CREATE TRIGGER check_row BEFORE INSERT ON prism.rows FOR EACH ROW EXECUTE FUNCTION prism.check_row()"
# It refuses metadata, an event, the cursor of a log, and another event at the end of the transaction.
sql "ALTER TABLE prism.segments ADD CONSTRAINT no_segment CHECK (gyro <> 'lab/parts'); ALTER TABLE prism.events ADD CONSTRAINT no_two CHECK (text <> 'two');
ALTER TABLE prism.places ADD CONSTRAINT no_place CHECK (gyro <> 'lab/cursor');
CREATE TABLE known (kind text PRIMARY KEY); INSERT INTO known VALUES ('one'), ('two');
ALTER TABLE prism.events ADD FOREIGN KEY (kind) REFERENCES known DEFERRABLE INITIALLY DEFERRED"
gyro parts 5 events
gyro cursor
gyro late 5 late
gyro good
gyro other 3000
gyro bad 2000
gyro worse 100
gyro gap 5 missing
gyro position 5 position
gyro rounding 5 rounding
gyro axis 5 axis
touch "$dir/"$'\xff.sock'
start_relay
grow good other bad worse gap rounding parts
wait_for 10 sql_is "SELECT string_agg(segment || ' ' || row_number || ' ' || split_part(line, ',', 3), ', ' ORDER BY row_number) FROM prism.refused_rows WHERE gyro = 'lab/bad'" "1 7 7, 1 777 777, 1 1500 1500"
contains "the reason" "$(sql "SELECT why FROM prism.refused_rows WHERE gyro = 'lab/bad' AND row_number = 7")" 'violates check constraint "no_sevens"'
wait_for 20 sql_is "SELECT max(row_number) - count(*) FROM prism.rows WHERE gyro = 'lab/bad'" 3
for gyro in good other; do wait_for 20 sql_is "SELECT max(row_number) - count(*) FROM prism.rows WHERE gyro = 'lab/$gyro'" 0; done
same "refused rows of other gyros" "$(sql "SELECT count(*) FROM prism.refused_rows WHERE gyro NOT IN ('lab/bad', 'lab/worse', 'lab/parts')")" 0
wait_for 10 sql_above "SELECT count(*) FROM prism.refused_rows WHERE gyro = 'lab/worse' AND row_number % 10 = 3 AND why LIKE '%out of range%'" 9
same "good rows in refused_rows" "$(sql "SELECT count(*) FROM prism.refused_rows WHERE gyro = 'lab/worse' AND row_number % 10 <> 3")" 0
same "a gap of 2^64-1 rows" "$(sql "SELECT kind || ' ' || missing FROM prism.gaps WHERE gyro = 'lab/gap'")" "deleted 9223372036854775807"
same "the day of rounded times" "$(sql "SELECT DISTINCT arrival AT TIME ZONE 'UTC' FROM prism.rows WHERE gyro = 'lab/rounding'")" "1970-01-30 00:00:00"
same "messages about the axis" "$(grep -c 'lab/axis axis zzz[z.]*: skipped: expected 1 to 16 letters' relay.err)" 1
same "messages about a name that is not UTF-8" "$(grep -c 'xff.sock: skipped' relay.err)" 1
same "refused metadata" "$(sql "SELECT segment || ' ' || row_number || ' ' || line, why LIKE '%no_segment%' FROM prism.refused_rows WHERE gyro = 'lab/parts'")" "1 0 log.csv|t"
same "segments with refused metadata" "$(sql "SELECT count(*) FROM prism.segments WHERE gyro = 'lab/parts'")" 0
same "events" "$(sql "SELECT string_agg(text, ' ') FROM prism.events")" one
contains "message about an event" "$(cat relay.err)" 'lab/parts: PostgreSQL refused an event: '
same "rows of a log whose cursor is refused" "$(sql "SELECT count(*) FROM prism.rows WHERE gyro = 'lab/cursor'")" 0
log_is() { relay_is ".logs[] | select(.gyro == \"lab/$1\") | $2" "$3"; }
wait_for 5 log_is bad '"\(.refused_rows) \(.error)"' "3 "
wait_for 5 log_is cursor '.error | test("PostgreSQL refused the cursor: .*no_place")' true
wait_for 5 log_is position '.error | test("invalid response to rows")' true
wait_for 5 relay_is '.targets.postgresql | "\(.up) \(.error)"' "true "
same "messages about the log \"bad\"" "$(grep -c 'lab/bad z: PostgreSQL refused row [0-9]* of segment 1: .*no_sevens.*; see prism.refused_rows' relay.err)" 1
same "messages about the log \"worse\"" "$(grep -c 'lab/worse z: PostgreSQL refused row [0-9]* of segment 1: the value is out of range' relay.err)" 1

# A partition that another program drops is created again; its rows are not refused.
sql "DROP TABLE prism.rows_$(date -u +%Y%m%d)"
grow good other
same "refused rows after a dropped partition" "$(sql "SELECT count(*) FROM prism.refused_rows WHERE gyro NOT IN ('lab/bad', 'lab/worse', 'lab/parts')")" 0

# Every row of a log with a backlog is refused: the other gyros are not delayed by more than the division of a small page.
sql "ALTER TABLE prism.rows ADD CONSTRAINT nothing CHECK (gyro <> 'lab/worst')"
gyro worst 20000
wait_for 10 sql_above "SELECT count(*) FROM prism.refused_rows WHERE gyro = 'lab/worst'" 0
grow good
sql_above "SELECT 20000 - count(*) FROM prism.refused_rows WHERE gyro = 'lab/worst'" 0 || fail "the rows of a good gyro waited until all 20000 were refused"
sql_is "SELECT count(*) FROM prism.rows WHERE gyro = 'lab/worst'" 0 || fail "rows of the log \"worst\""

# A trigger refuses every row for a reason that is not in the data: the rows wait, the pause grows, the status has the error all the time.
sql "CREATE FUNCTION prism.no() RETURNS trigger LANGUAGE plpgsql AS \$\$ BEGIN RAISE EXCEPTION 'closed for today'; END \$\$;
CREATE TRIGGER no BEFORE INSERT ON prism.rows FOR EACH ROW EXECUTE FUNCTION prism.no()"
wait_for 10 relay_is '.targets.postgresql | "\(.up) \(.error | test("closed for today"))"' "false true"
contains "human-readable status" "$(prismrelay --status relay.json)" "DOWN since"
first=$(relay_says .targets.postgresql.failures) begin=$(date +%s%N)
until [ "$(relay_says .targets.postgresql.failures)" -ge $((first + 6)) ]; do
  same "the status while rows are refused" "$(relay_says '.targets.postgresql | "\(.up) \(.error | test("closed for today"))"')" "false true"
done
took_ms=$((($(date +%s%N) - begin) / 1000000))
[ "$took_ms" -ge 3000 ] || fail "6 attempts within $took_ms ms, expected growing pauses: 100, 200, 400, 800 and 1600 ms"
same "messages about the trigger" "$(grep -c 'closed for today' relay.err)" 1
same "rows refused by the trigger" "$(sql "SELECT count(*) FROM prism.refused_rows WHERE why LIKE '%closed%'")" 0
sql "DROP TRIGGER no ON prism.rows"
wait_for 30 relay_is '.targets.postgresql | "\(.up) \(.error)"' "true "
grow good other bad worse gap
same "rows lost" "$(sql "SELECT max(row_number) - min(row_number) + 1 - count(*) FROM prism.rows WHERE gyro = 'lab/good'")" 0

# While the server is stopped, the relay warns if prismd will delete rows that the database does not have.
stop_postgres immediate
wait_for 30 grep -q 'lab/late z: 51 rows behind, more than half of those that prismd keeps' relay.err
run_postgres
wait_for 30 grep -q 'lab/late z: less than half of the kept rows behind again' relay.err
same "warnings about other gyros" "$(grep 'rows behind, more than half' relay.err | grep -vc 'lab/late z: ')" 0
kill -TERM "$relay"; wait "$relay" || fail "exit code $?"
