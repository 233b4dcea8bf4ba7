# SPDX-License-Identifier: MIT
# prismrelay --init: creates the schema, and brings an older one to this version with all its rows; the version number decides.
. "$(dirname "$0")/lib.sh"
. "$PRISM_SOURCE/tests/system/servers.sh"
start_postgres
relay_config
objects() { sql "SELECT c.relname || coalesce(' ' || string_agg(a.attname || ' ' || format_type(a.atttypid, a.atttypmod) || ' ' || a.attnotnull, ',' ORDER BY a.attname), '') FROM pg_class c LEFT JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0 AND NOT a.attisdropped WHERE c.relnamespace = 'prism'::regnamespace AND c.relname !~ '^rows_2' GROUP BY c.relname ORDER BY 1"; }
drop() { sql 'SET client_min_messages = error; DROP SCHEMA prism CASCADE'; }
same "a new schema" "$(prismrelay --init relay.json)" "created schema prism, version 2"
objects >complete
same "an existing schema" "$(prismrelay --init relay.json)" "schema prism exists, version 2"

# The schema of 0.3 with the rows of a gyro, after which the relay continues: all rows are kept.
drop
psql -X -q -v ON_ERROR_STOP=1 -h "$dir/pg" -U relay prism <"$PRISM_SOURCE/tests/system/relay-schema-0.3.sql" >out 2>&1 || fail "the schema of 0.3: $(cat out)"
id=$(printf %032d 0)
day=$(date -u +%Y-%m-%d)
sql "CREATE TABLE prism.rows_${day//-/} PARTITION OF prism.rows FOR VALUES FROM ('$day 00:00:00+00') TO ('$day 24:00:00+00');
INSERT INTO prism.rows (gyro, axis, log, segment, row_number, arrival, time, samples, rate_deg_per_h, sensors) SELECT 'lab/hostile', 'z', '$id', 1, i, '$day 00:00:00+00', '$day 00:00:00+00', 50, 8.5, '{\"case_degc\": 24.5}' FROM generate_series(1, 5) i;
INSERT INTO prism.rows (gyro, axis, log, segment, row_number, arrival, time) VALUES ('far/g', 'x', '$id', 1, 1, '$day 00:00:00+00', '$day 00:00:00+00');
INSERT INTO prism.places (gyro, axis, cursor, log, segment, row_number, arrival, rows) VALUES ('lab/hostile', 'z', '$id-1-6-9', '$id', 1, 5, '$day 00:00:00+00', 5);
INSERT INTO prism.segments (gyro, axis, log, segment, file, metadata) VALUES ('lab/hostile', 'z', '$id', 1, 'f', '{}');
INSERT INTO prism.gaps (gyro, axis, kind, behind, missing) VALUES ('lab/hostile', 'z', 'deleted', 'c', 3);
INSERT INTO prism.refused_rows (gyro, axis, log, segment, row_number, why, line) VALUES ('lab/hostile', 'z', '$id', 1, 6, 'w', 'l');
INSERT INTO prism.events (gyro, time, severity, kind, text) VALUES ('lab/hostile', '$day 00:00:00+00', 'info', 'note', 't')"
contents() {  # without the columns that 0.3 does not have
  sql "SELECT to_jsonb(r) - 'sent_deg_per_h' - 'offset_deg_per_h' FROM prism.rows r" | sort
  for table in segments places gaps refused_rows; do sql "TABLE prism.$table" | sort; done
  sql "SELECT * FROM prism.events WHERE kind = 'note'"
}
contents >before
same "--init on the schema of 0.3" "$(prismrelay --init relay.json)" "updated schema prism from version 1 to 2"
objects >now
cmp -s complete now || fail "the schema after the upgrade: $(diff complete now)"
contents >after
cmp -s before after || fail "the upgrade changed the contents: $(diff before after)"
start_hostile hostile
start_relay
wait_for 20 relay_is '.logs[] | "\(.gyro) \(.caught_up)"' "lab/hostile true"
wait_for 20 sql_is "SELECT count(*) FROM prism.events WHERE kind <> 'note'" 1
contents >after
cmp -s before after || fail "the relay changed the contents: $(diff before after)"
kill -TERM "$relay"; wait "$relay" || fail "exit code $?"

# Tables without a version, e.g. after a --schema that was interrupted: --init creates what is missing and keeps the rest.
sql "SET client_min_messages = error; DELETE FROM prism.version; DROP TABLE prism.gaps"
same "--init without a version" "$(prismrelay --init relay.json)" "created schema prism, version 2"
same "the rows" "$(sql "SELECT count(*) FROM prism.rows")" 6
objects >now
cmp -s complete now || fail "the schema: $(diff complete now)"

# An --init that fails has no effect.
sql "DELETE FROM prism.version; DROP VIEW prism.days; CREATE VIEW prism.days AS SELECT 1 AS one; DROP TABLE prism.gaps"
objects >before
code=0; prismrelay --init relay.json >out 2>refused.err || code=$?
same "exit code" "$code" 1
contains "the error" "$(cat refused.err)" 'cannot change name of view column "one"'
same "lines of the error" "$(wc -l <refused.err)" 1
objects >now
cmp -s before now || fail "a failed --init changed: $(diff before now)"

# Several --init at once: each succeeds, and one of them creates the schema.
for round in 1 2 3; do
  drop
  pids=()
  for i in 1 2 3 4; do prismrelay --init relay.json >"out$i" 2>&1 & pids+=($!); done
  for one in "${pids[@]}"; do wait "$one" || fail "--init at the same time: $(cat out?)"; done
  same "creations" "$(cat out? | sort | uniq -c | tr -s ' ')" " 1 created schema prism, version 2
 3 schema prism exists, version 2"
done

# The SQL of --schema is accepted on a complete schema, and creates a table that was dropped.
sql "SET client_min_messages = error; DROP TABLE prism.events"
prismrelay --schema | psql -X -q -v ON_ERROR_STOP=1 -h "$dir/pg" -U relay prism >out 2>&1 || fail "the SQL of --schema: $(cat out)"
same "--init after --schema" "$(prismrelay --init relay.json)" "schema prism exists, version 2"
objects >now
cmp -s complete now || fail "the schema after --schema: $(diff complete now)"

# A database that cannot store every text is refused.
drop
as_server "$postgres_bin/createdb" -h "$dir/pg" -U relay -E LATIN1 -T template0 --locale=C latin
jq '.postgresql.connection |= sub("dbname=prism"; "dbname=latin")' relay.json >latin.json
code=0; prismrelay --init latin.json >out 2>refused.err || code=$?
same "exit code for the encoding LATIN1" "$code $(cat refused.err)" "1 prismrelay: postgresql: the database has the encoding LATIN1, expected UTF8"
