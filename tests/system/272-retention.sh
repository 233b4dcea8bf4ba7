# SPDX-License-Identifier: MIT
# Retention never surprises: a replay deletes nothing, the date of a row does not matter, the next deletion is in the status before it happens, each one
# is an event, and prismcal reports them.
# Background: rows dated 1970 were deleted as ten years old when the right year came; a replay deleted its own output and counted its rows.
. "$(dirname "$0")/lib.sh"
frames 2
config
rows_in() { cat "$1"/*.csv | grep -cv '^[#t]'; }

# A replay of 2.5 hours, twice, with limits of an hour's log and of a day, with rows of 1970 and of 2026.
jq '.log.segment_mib = 0.1 | .log.keep_mib = 1 | .log.keep_days = 1 | .log.when_full = "delete_oldest"' gyro.json >keep.json && mv keep.json gyro.json
prismsim --profile second --hours 2.5 --frames frames.json --out run.pcap >sim.out 2>&1 || fail "prismsim: $(cat sim.out)"
python3 - <<'END'
# The second copy of the recording begins in 1970.
import struct
data = bytearray(open("run.pcap", "rb").read())
at, first = 24, None
while at < len(data):
    seconds, _, size, _ = struct.unpack_from("<IIII", data, at)
    first = seconds if first is None else first
    struct.pack_into("<I", data, at, seconds - first + 60)
    at += 16 + size
open("1970.pcap", "wb").write(data)
END
prismd gyro.json --replay 1970.pcap --replay run.pcap --out log >replay.out 2>replay.err || fail "replay: $(cat replay.err)"
left=$(rows_in log)
same "rows in the summary" "$(sed -n 's/^log: \([0-9]*\) rows.*/\1/p' replay.out)" "$left"
[ "$left" -gt 17900 ] || fail "found $left rows, expected those of 5 hours"
[ -n "$(ls log/gyro-*-1970*.csv)" ] || fail "found no rows of 1970"
made=$(ls log | wc -l)
oldest=$(ls log | head -1)
contains "deletions of a replay" "$oldest" gyro-000001-

# Live, in the same directory: the next deletion is announced. Its reason is the bytes, not the date.
rows=$(grep -cv '^[#t]' "log/$oldest")
start_sim --profile steady --speed 1
start_prismd
wait_for 15 field_is .log.retention.next.file status "$oldest"
same "the next deletion" "$(field '.log.retention.next | "\(.rows) \(.why) \(.in_s <= 60) \(.time_s - now | fabs < 70)"' status)" "$rows bytes true true"
contains "prismctl status" "$(prismctl status)" "deletes next $oldest ($rows rows) in "
contains "its reason" "$(prismctl status | grep '^deletes next')" ": more than 1.0 MiB"
same "deleted before the announcement" "$(rows_in log | awk -v left="$left" '{ print ($1 >= left) }')" 1

# A reader that comes too late is counted, once.
late=$(prismctl rows --limit 1 2>&1 >/dev/null | sed 's/.*--after //')
wait_for 90 test ! -e "log/$oldest"
wait_for 30 field_above .log.retention.deleted_segments status 2
wait_for 30 bash -c "prismctl events | grep -q 'deleted $oldest ($rows rows, .* MiB): more than 1.0 MiB (log/keep_mib)'"
contains "stderr" "$(cat prismd.err)" "log: deleted $oldest ($rows rows, "
for _ in 1 2; do contains "a late reader" "$(prismctl rows --after "$late" --limit 1 2>&1)" "rows are missing here"; done
wait_for 5 field_above .log.gone status $((rows - 2))
same "its error" "$(first_answer '{"jsonrpc":"2.0","id":1,"protocol":2,"method":"rows","params":{"after":"'"$late"'"}}' | jq -c '.error | [.code, .data.axes.z.first, .data.axes.z.missing == .data.axes.z.last - 1, .data.axes.z.more]')" '[-32007,2,true,true]'
[ "$(prismctl --json events | jq -s 'flatten | map(select(.kind == "retention" and (.text | contains(": deleted ")))) | length')" -ge 3 ] || fail "events: $(prismctl events)"
wait_for 60 bash -c "[ \$(du -bc log/*.csv | tail -1 | cut -f1) -lt 1200000 ]"
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"
left_first=log/$(ls log | head -1)
rows_gone=$(($(sed -n 's/^# log: .* first \([0-9]*\) .*/\1/p' "$left_first") - 1))
still=$(ls log/* | awk -F- -v made="$made" '$2 <= made')
same "rows that were deleted" "$rows_gone" "$((left - $(cat $still | grep -cv '^[#t]')))"

# prismcal reports the deletions.
text="begins with segment $(basename "$left_first" | awk -F- '{ print $2 + 0 }'): $rows_gone rows of the log are not here, before $(grep -m1 '^[0-9]' "$left_first" | cut -c1-19)Z"
prismcal verify log >verify.out || fail "verify: $(cat verify.out)"
contains "verify" "$(cat verify.out)" "log: deleted: $text"
contains "train" "$(prismcal train log --inputs T --method ls --no-earth-rate --out model.json 2>&1)" "$text"
contains "evaluate" "$(prismcal evaluate "$PRISM_SOURCE/config/models/tao2019-model2.json" log --any-gyro --no-earth-rate 2>&1)" "$text"
