# SPDX-License-Identifier: MIT
# One damaged item affects only itself: each damage of a log's segment × each program that reads the log. The rows of the other segments
# arrive, and the damaged one is named once. Refused rows of a database: 275-relay-refused; hostile names: 300-hostile-texts.
. "$(dirname "$0")/lib.sh"
export PYTHONPATH=$PRISM_SOURCE/clients/python PYTHONDONTWRITEBYTECODE=1
frames 10
config
jq 'del(.model) | .name = "gyro" | .log.segment_mib = 0.05' gyro.json >small.json && mv small.json gyro.json
prismsim --profile second --hours 0.7 --frames frames.json --out run.pcap 2>sim.err || fail "$(cat sim.err)"
prismd gyro.json --replay run.pcap --out good >/dev/null 2>replay.err || fail "$(cat replay.err)"
victim=$(basename "$(ls good/*.csv | sed -n 3p)")
touch tty  # an absent gyro: the log does not grow
for file in good/*.csv; do [ "$(basename "$file")" = "$victim" ] || grep -v '^[#t]' "$file"; done >neighbours
[ "$(wc -l <neighbours)" -gt 1000 ] || fail "too few rows: $(wc -l <neighbours)"

# Each damages the file $1.
torn_row() { sed -i '100s/,.*//' "$1"; }
wrong_number() { sed -i '100s/,/,x/2' "$1"; }
extra_field() { sed -i '100s/$/,1/' "$1"; }
not_utf8() { LC_ALL=C sed -i '100s/,[0-9]/,\xff/2' "$1"; }
zeros() { printf '%0200d' 0 | tr 0 '\0' | dd of="$1" bs=1 seek=15000 conv=notrunc status=none; }
cut_short() { truncate -s 9000 "$1"; }
empty() { truncate -s 0 "$1"; }
no_header() { sed -i '1,18d' "$1"; }
noise() { head -c 30000 /dev/zero | openssl enc -aes-128-ctr -pass pass:1 -nosalt 2>/dev/null >"$1"; }
folder() { rm "$1"; mkdir "$1"; }

# neighbours_in FILE WHO: fails if a row of another segment is missing in FILE.
neighbours_in() { same "$2: rows of other segments that are missing" "$(grep -cvxFf "$1" neighbours || true)" 0; }
# named_once FILE WHO: fails unless exactly one line of FILE names the victim.
named_once() { same "$2: times that the segment is named" "$(grep -acF "$victim" "$1" || true)" 1; }

read_by_prismctl() {
  prismctl rows --after earliest >"$1.rows" 2>"$1.err" || fail "$1, prismctl: $(cat "$1.err")"
  neighbours_in "$1.rows" "$1, prismctl"
}
read_by_python() {
  timeout 120 python3 - neighbours "$victim" "$2" <<'END' || fail "$1, Python client"
import sys
import prism
_, neighbours, victim, is_row = sys.argv
pages = list(prism.Gyro().log(after="earliest"))
found = {row["time_s"] for page in pages for row in page.rows}
expected = {float(line.split(",")[1]) for line in open(neighbours)}
assert expected <= found, f"{len(expected - found)} rows of other segments are missing"
damaged = [text for page in pages for text in page.damaged]
assert not int(is_row) or len(damaged) == 1 and damaged[0].startswith(victim), damaged
END
}
read_by_web() {
  rm -rf "$dir/state"
  web_state=$dir/state
  start_web
  timeout 120 python3 - neighbours "$url" "$token" <<'END' || fail "$1, prismweb: $(cat web.err)"
import json, sys, time, urllib.request
_, rows, url, token = sys.argv
expected = sum(1 for line in open(rows))
deadline = time.time() + 100
while True:
    request = urllib.request.Request(f"{url}api/gyro/range?seconds=4000&points=5000", headers={"Authorization": f"Bearer {token}"})
    answer = json.load(urllib.request.urlopen(request, timeout=60))
    found = sum(row[answer["columns"].index("seconds")] if "seconds" in answer["columns"] else 1 for row in answer["rows"])
    if found >= expected:
        break
    assert time.time() < deadline, f"found {found} seconds, expected {expected} or more: {str(answer)[:300]}"
    time.sleep(0.2)
END
  kill "$web"; wait "$web" 2>/dev/null || true
}
read_by_prismcal() {
  prismcal allan log --json >"$1.json" 2>"$1.cal" || fail "$1, prismcal: $(cat "$1.cal")"
  values=$(jq '.facts.data | capture("(?<n>[0-9]+) values").n | tonumber' "$1.json")
  [ "$values" -ge "$(($(wc -l <neighbours) - 1))" ] || fail "$1, prismcal: found $values values of $(wc -l <neighbours)"
  named_once "$1.cal" "$1, prismcal"
  prismcal verify log >"$1.verify" 2>&1 && fail "$1: prismcal verify finds nothing"
  contains "$1, prismcal verify" "$(cat "$1.verify")" "$victim"
}

for damage in torn_row wrong_number extra_field not_utf8 zeros cut_short empty no_header noise folder; do
  rm -rf log; cp -r good log
  "$damage" "log/$victim"
  : >prismd.err
  start_prismd
  read_by_prismctl "$damage"
  case $damage in torn_row | wrong_number | extra_field | not_utf8) is_row=1 ;; *) is_row=0 ;; esac
  read_by_python "$damage" $is_row
  read_by_web "$damage"
  kill "$prismd"; wait "$prismd" 2>/dev/null || true
  read_by_prismcal "$damage"
done
