# SPDX-License-Identifier: MIT
# A capture truncated anywhere replays up to the cut and is reported; a missing capture is an error of one line.
. "$(dirname "$0")/lib.sh"
frames 20
config
prismsim --profile steady --hours 0.2 --frames "$dir/frames.json" --out "$dir/whole.pcap" >/dev/null
size=$(stat -c %s "$dir/whole.pcap")
for part in 3 11 24 25 40 41 67 1000 $((size / 2)) $((size - 1)); do
  head -c "$part" "$dir/whole.pcap" >"$dir/torn.pcap"
  code=0
  prismd "$dir/gyro.json" --replay "$dir/torn.pcap" --out "$dir/r$part" >"$dir/o" 2>"$dir/e" || code=$?
  [ "$code" -le 1 ] || fail "cut at $part: exit code $code: $(cat "$dir/e")"
done
contains "error for a cut one byte before the end" "$(cat "$dir/e")" "torn.pcap"
contains "summary of its replay" "$(cat "$dir/o")" "replayed"
code=0; prismd "$dir/gyro.json" --replay "$dir/none.pcap" 2>"$dir/e" || code=$?
same "exit code for a missing capture" "$code" 1
same "lines of the error" "$(wc -l <"$dir/e")" 1
