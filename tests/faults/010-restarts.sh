# SPDX-License-Identifier: MIT
# A log after clean restarts, kills, replugs and a host clock that was set back: the seconds of each session increase and occur
# once, and train, evaluate and allan read the directory and report what they left out.
# History: each of these events made all three commands reject the complete directory.
. "$(dirname "$0")/lib.sh"
frames 50
config '"site": {"latitude_deg": 45, "elevation_deg": 30}, "capture": {"directory": "'"$dir"'/capture"}'
sed -i 's/"clock": "device"/"clock": "host"/' "$dir/gyro.json"
start_sim --profile second --speed 1

receives() { wait_for 10 field_is .state status receiving; }
for _ in $(seq "$(long 3 100)"); do
  start_prismd; receives; grows .log.rows status 1
  kill -TERM "$prismd"; wait "$prismd" || fail "clean restart: exit code $?"
done
for _ in $(seq "$(long 3 100)"); do
  start_prismd; receives; grows .log.rows status 1; sleep "0.$((RANDOM % 10))"
  kill -9 "$prismd"; wait "$prismd" 2>/dev/null || true
done
start_prismd
for _ in $(seq "$(long 3 100)"); do
  receives; grows .log.rows status 1
  kill -9 "$sim"; wait "$sim" 2>/dev/null || true; rm -f "$dir/tty"
  start_sim --profile second --speed 1
done
receives; grows .log.rows status 12
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"

# Sets prismd's host clock back while it runs; other processes keep the true time.
fake=$(find /usr/lib -name libfaketimeMT.so.1 -print -quit 2>/dev/null || true)
[ -n "$fake" ] || skip "no libfaketime (tools/setup installs it): the clock steps were not tested"
echo '+0' >"$dir/offset"
start prismd env LD_PRELOAD="$fake" FAKETIME_TIMESTAMP_FILE="$dir/offset" FAKETIME_NO_CACHE=1 FAKETIME_DONT_FAKE_MONOTONIC=1 \
  prismd "$dir/gyro.json"
prismd=$pid
receives; grows .log.rows status 1
offset=0
for _ in $(seq "$(long 3 20)"); do
  offset=$(awk -v now="$offset" -v r="$RANDOM" 'BEGIN { printf "%.1f", now - 0.6 - (r % 3600) }')
  steps=$(grep -c 'host clock stepped' "$dir/prismd.err" || true)
  echo "$offset" >"$dir/offset"
  wait_for 5 sh -c "[ \$(grep -c 'host clock stepped' '$dir/prismd.err') -gt ${steps:-0} ]"
  grows .log.rows status 2
done
grows .log.rows status 12
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"

python3 - "$dir/log" <<'END' || fail "the log is inconsistent"
import glob, hashlib, sys
folder = sys.argv[1]
seen, ends, torn, partial, bad = {}, 0, 0, 0, []
made = sorted(path.split("/")[-1] for path in glob.glob(folder + "/*.csv"))
first = 1
for name in made:
    text = open(folder + "/" + name).read()
    session = [line for line in text.split("\n") if line.startswith("# session: ")][0]
    position = [line.split() for line in text.split("\n") if line.startswith("# log: ")][0]
    if position[4] != str(int(name.split("-")[-2])) or position[6] != str(first): bad.append("%s: position %s, expected first %d" % (name, position, first))
    rows = [line.split(",") for line in text.split("\n") if line[:1].isdigit()]
    if "# end: " in text:
        body, end = text.split("# end: ")
        ends += 1
        if end != "rows %d, sha256 %s\n" % (len(rows), hashlib.sha256(body.encode()).hexdigest()): bad.append(name + ": wrong end line")
    else:
        torn += 1
        rows = rows if text.endswith("\n") else rows[:-1]
    first += len(rows)
    for row in rows:
        second = int(row[1])
        if second <= seen.get(session, -1): bad.append("%s: second %d is a repeat or out of order" % (name, second))
        seen[session] = second
        partial += row[17] == "1"
        if row[17] == "0" and abs(int(row[2]) + int(row[3]) - 50) > 2: bad.append("%s: a complete second with %s frames" % (name, row[2]))
print(len(made), "segments,", len(seen), "sessions,", ends, "ended,", torn, "truncated,", partial, "partial rows")
if bad: print("\n".join(bad[:10])); sys.exit(1)
END

cal=("$dir/log" --json)
# --force: the few seconds at one temperature are too little to train on; the test only checks that the directory is read.
prismcal train "$dir/log" --force --method ls --inputs T --window 3 --end-mean 2 --max-gap 2 --out "$dir/model.json" >"$dir/train" 2>&1 ||
  fail "train: $(cat "$dir/train")"
prismcal evaluate "$dir/model.json" --in-sample "${cal[@]}" >"$dir/evaluate.json" 2>"$dir/evaluate.txt" || fail "evaluate: $(cat "$dir/evaluate.txt")"
prismcal allan "${cal[@]}" >"$dir/allan.json" 2>"$dir/allan.txt" || fail "allan: $(cat "$dir/allan.txt")"
for found in train evaluate.json allan.txt; do
  contains "$found" "$(cat "$dir/$found")" "partial, at the start or end of a session"
  contains "$found" "$(cat "$dir/$found")" "without an end"
done
