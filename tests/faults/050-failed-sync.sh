# SPDX-License-Identifier: MIT
# fdatasync fails with EIO: one error and one recovery are reported. The log has each second once: a new segment supersedes rows that
# may not be on the disk. The capture has each frame; a segment ends at its last successful sync.
# History: the log continued with the same descriptor and reported a recovery.
. "$(dirname "$0")/lib.sh"
on_a_shimmed_disk 2 "\"capture\": {\"directory\": \"$dir/capture\"}"
echo eio >"$dir/disk"
wait_for 5 grep -q "cannot be synced" "$dir/prismd.err"
wait_for 5 grep -q "capture: .*Input/output error" "$dir/prismd.err"
sleep "$(long 2 60)"  # further syncs fail
echo good >"$dir/disk"
wait_for 60 grep -q 'log: writing again' "$dir/prismd.err"
wait_for 60 grep -q 'capture: writing again after 0 bytes' "$dir/prismd.err"
grows .log.rows status 2
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"
same "reported errors of the log" "$(grep -c 'cannot be synced' "$dir/prismd.err")" 1
same "reported errors of the capture" "$(grep -c 'capture: .*Input/output error' "$dir/prismd.err")" 1
[ "$(ls "$dir"/log/*.csv | wc -l)" -le 3 ] || fail "found a log file for each second: $(ls "$dir/log")"
grep -q '^# supersedes: ' "$dir"/log/*.csv || fail "no segment supersedes another"
python3 - "$dir/log" <<'END' || fail "seconds are missing or duplicate"
import glob, re, sys
rows, superseded = {}, {}
for path in sorted(glob.glob(sys.argv[1] + "/*.csv")):
    text = open(path).read()
    for name, row in re.findall(r"^# supersedes: (\S+) from row (\d+)$", text, re.M): superseded[name] = int(row)
    rows[path.split("/")[-1]] = [line.split(",") for line in text.splitlines() if line[:1].isdigit()]
seconds = [int(row[1]) for name, all_rows in rows.items() for row in all_rows[: superseded.get(name, 10**9) - 1]]
print(seconds)
sys.exit(sorted(seconds) != list(range(min(seconds), max(seconds) + 1)))
END
captures=("$dir"/capture/*.pcap)
[ ${#captures[@]} -le 3 ] || fail "found a capture file for each second: ${captures[*]}"
prismcal verify "${captures[@]}" || fail "a capture is damaged"
prismd "$dir/gyro.json" --replay "${captures[0]}" $(printf -- '--replay %s ' "${captures[@]:1}") --out "$dir/replayed" >"$dir/replay.txt"
cat "$dir/replay.txt"
contains "replay of the captures" "$(cat "$dir/replay.txt")" " 0 missing"
