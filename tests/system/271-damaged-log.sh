# SPDX-License-Identifier: MIT
# A segment in the middle of the log was cut short. Every client gets the rows after it; the lost rows are counted, with one event.
# Background: prismd returned an empty page with "more" and the same cursor, for ever, also after a restart.
. "$(dirname "$0")/lib.sh"
frames 10
config
jq '.log.segment_mib = 0.02' gyro.json >small.json && mv small.json gyro.json
prismsim --profile second --hours 0.2 --frames frames.json --out run.pcap >sim.out 2>&1 || fail "prismsim: $(cat sim.out)"
prismd gyro.json --replay run.pcap --out log >replay.out 2>replay.err || fail "replay: $(cat replay.err)"
file=$(ls log/gyro-000003-*.csv)
last=$(ls log/gyro-*.csv | tail -1)
[ "$file" != "$last" ] || fail "found too few segments: $(ls log)"
all=$(cat log/*.csv | grep -cv '^[#t]')
rows=$(grep -cv '^[#t]' "$file")
lost=$((rows - rows / 2))
row=$(grep -v '^[#t]' "$file" | sed -n "$((rows / 2 + 1))p")
truncate -s "$(grep -abF "$row" "$file" | cut -d: -f1 | tail -1)" "$file"
same "rows that are left" "$(grep -cv '^[#t]' "$file")" $((rows / 2))

start_sim --profile steady --speed 1
start_prismd
for run in "as written" "after a restart"; do
  start follow prismctl --socket "$PRISM_SOCKET" rows --follow --after earliest
  follow=$pid
  wait_for 20 bash -c "[ \$(grep -cv ^time_utc '$dir/follow.out') -gt $((all - lost)) ]"
  kill "$follow"; wait "$follow" 2>/dev/null || true
  contains "prismctl, $run" "$(cat follow.err)" "prismctl: $lost rows are missing here: deleted or damaged before they were fetched"
  same "times that prismctl reported it, $run" "$(grep -c 'are missing here' follow.err)" 1
  : >follow.err
  PYTHONPATH=$PRISM_SOURCE/clients/python PYTHONDONTWRITEBYTECODE=1 timeout 120 python3 - "$((all - lost))" "$lost" <<'END' || fail "the Python client, $run"
import sys
import prism
pages = list(prism.Gyro().log(after="earliest"))
rows, missing = sum(len(page.rows) for page in pages), sum(page.missing for page in pages)
assert rows > int(sys.argv[1]) and missing == int(sys.argv[2]), (rows, missing)
END
  same "events, $run" "$(prismctl --json events | jq -rs 'flatten | map(select(.kind == "log_damaged").text) | join("\n")')" \
    "log: $(basename "$file"): found $((rows / 2)) of $rows rows that were written; the others are missing for clients"
  contains "stderr, $run" "$(cat prismd.err)" "found $((rows / 2)) of $rows rows"
  kill "$prismd"; wait "$prismd" 2>/dev/null || true
  start_prismd
done

# A consumer whose stored cursor is within the lost rows continues after them.
id=$(sed -n 's/^# log: \([0-9a-f]*\) .*/\1/p' "$file")
first=$(sed -n 's/^# log: .* first \([0-9]*\) .*/\1/p' "$file")
prismctl rows --after "$id-3-$((rows / 2))-$((first - 1 + rows / 2))" --limit 1 >one 2>one.err || fail "rows: $(cat one.err)"
same "first row after the gap" "$(tail -1 one)" "$(grep -v '^[#t]' log/gyro-000004-*.csv | head -1)"
