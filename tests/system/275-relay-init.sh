# SPDX-License-Identifier: MIT
# prismrelay --init on a schema with missing or different objects. Before, it reported any schema of the right version as complete,
# and the relay could not work.
. "$(dirname "$0")/lib.sh"
. "$PRISM_SOURCE/tests/system/servers.sh"
start_postgres
relay_config
objects() { sql "SELECT c.relname || coalesce(' ' || string_agg(a.attname || ' ' || format_type(a.atttypid, a.atttypmod) || ' ' || a.attnotnull, ',' ORDER BY a.attname), '') FROM pg_class c LEFT JOIN pg_attribute a ON a.attrelid = c.oid AND a.attnum > 0 AND NOT a.attisdropped WHERE c.relnamespace = 'prism'::regnamespace GROUP BY c.relname ORDER BY 1"; }
same "a new schema" "$(prismrelay --init relay.json)" "created schema prism, version 1"
objects >complete
same "an existing schema" "$(prismrelay --init relay.json)" "schema prism exists, version 1"

# completes DAMAGE REPORT: after the SQL statement DAMAGE, --init reports REPORT and restores the objects of a new schema.
completes() {
  sql "SET client_min_messages = error; $1"
  same "--init after: $1" "$(prismrelay --init relay.json)" "completed schema prism, version 1: created $2"
  objects >now
  cmp -s complete now || fail "objects after $1: $(diff complete now)"
  same "--init again" "$(prismrelay --init relay.json)" "schema prism exists, version 1"
}
completes "DROP TABLE prism.gaps" "table gaps"
completes "DROP TABLE prism.refused_rows, prism.events" "table events, table refused_rows"
completes "DROP TABLE prism.places CASCADE" "view latest, table places"
completes "DROP TABLE prism.rows CASCADE; DROP VIEW IF EXISTS prism.days" "view days, view hourly, view latest, partitioned table rows, partitioned index rows_arrival, view stability"
completes "DROP TABLE prism.version" "table version"
completes "DELETE FROM prism.version" "row of version"
completes "DROP INDEX prism.rows_arrival" "partitioned index rows_arrival"
completes "DROP VIEW prism.stability" "view stability"
completes "ALTER TABLE prism.places DROP CONSTRAINT places_pkey" "primary key of places"
completes "ALTER TABLE prism.segments DROP COLUMN noticed, DROP COLUMN file" "column segments.file, column segments.noticed"
completes "ALTER TABLE prism.rows DROP COLUMN sd_mean_deg_per_h, DROP COLUMN partial CASCADE" "view hourly, view stability, column rows.sd_mean_deg_per_h, column rows.partial"

# A row survives a completion.
sql "INSERT INTO prism.gaps (gyro, axis, kind, behind, missing) VALUES ('lab/g', 'z', 'deleted', 'c', 3); DROP TABLE prism.events"
prismrelay --init relay.json >/dev/null
same "a stored row" "$(sql "SELECT missing FROM prism.gaps")" 3

# differs DAMAGE ERROR UNDO: --init fails with ERROR, leaves the objects unchanged, and succeeds after UNDO.
differs() {
  sql "SET client_min_messages = error; $1"
  objects >before
  code=0; prismrelay --init relay.json >out 2>refused.err || code=$?
  same "exit code after $1" "$code" 1
  contains "error after $1" "$(cat refused.err)" "$2"
  same "lines of the error" "$(wc -l <refused.err)" 1
  objects >now
  cmp -s before now || fail "a failed --init changed: $(diff before now)"
  sql "SET client_min_messages = error; $3"
  prismrelay --init relay.json >out || fail "--init after $3"
}
differs "ALTER TABLE prism.gaps ALTER missing TYPE text" "the schema prism differs from version 1: column prism.gaps.missing has the type text, expected bigint" "ALTER TABLE prism.gaps ALTER missing TYPE bigint USING missing::bigint"
differs "DROP TABLE prism.events; CREATE VIEW prism.events AS SELECT 1 AS gyro" "found the view prism.events, expected a table" "DROP VIEW prism.events"
differs "DROP VIEW prism.days; CREATE VIEW prism.days AS SELECT current_date AS day; DROP TABLE prism.events" "view prism.days has no column bytes; drop the view to get a new one; view prism.days has no column rows_about" "DROP VIEW prism.days"
differs "ALTER TABLE prism.gaps DROP CONSTRAINT gaps_pkey, ADD PRIMARY KEY (gyro)" "prism.gaps has PRIMARY KEY (gyro), expected PRIMARY KEY (gyro, axis, behind, kind)" "ALTER TABLE prism.gaps DROP CONSTRAINT gaps_pkey"
differs "ALTER TABLE prism.places ADD COLUMN mine text NOT NULL" "column prism.places.mine is NOT NULL without a default" "ALTER TABLE prism.places ALTER mine DROP NOT NULL"
differs "DROP INDEX prism.rows_arrival; CREATE INDEX rows_arrival ON prism.gaps (gyro)" "found the index prism.rows_arrival, expected a partitioned index" "DROP INDEX prism.rows_arrival"
differs "ALTER TABLE prism.gaps DROP COLUMN kind CASCADE" "ALTER TABLE prism.gaps ADD COLUMN kind text NOT NULL: column \"kind\"" "DELETE FROM prism.gaps"
sql "ALTER TABLE prism.places DROP COLUMN mine"

# Several --init at once: each succeeds, and one of them creates the schema.
for round in 1 2 3; do
  sql 'SET client_min_messages = error; DROP SCHEMA prism CASCADE'
  pids=()
  for i in 1 2 3 4; do prismrelay --init relay.json >"out$i" 2>&1 & pids+=($!); done
  for one in "${pids[@]}"; do wait "$one" || fail "--init at the same time: $(cat out?)"; done
  same "creations" "$(cat out? | sort | uniq -c | tr -s ' ')" " 1 created schema prism, version 1
 3 schema prism exists, version 1"
done

# The SQL of --schema is accepted on a complete schema, and completes one.
sql "SET client_min_messages = error; DROP TABLE prism.events"
prismrelay --schema | psql -X -q -v ON_ERROR_STOP=1 -h "$dir/pg" -U relay prism >out 2>&1 || fail "the SQL of --schema: $(cat out)"
same "--init after --schema" "$(prismrelay --init relay.json)" "schema prism exists, version 1"
