# SPDX-License-Identifier: MIT
# Two replays of a live run's capture write the log of that run again, byte for byte. The host clock is the hard case,
# because its rows depend on arrival times.
. "$(dirname "$0")/lib.sh"
config '"capture": {"directory": "'"$dir"'/capture"}'
sed -i 's/"clock": "device"/"clock": "host"/; s/"silence_s": 1/"silence_s": 60/' "$dir/gyro.json"
start_sim --profile steady --speed 1 --damage-bytes 1e-4 --drop-bytes 1e-4
start_prismd
wait_for 5 field_above .log.rows status 2
kill -9 "$sim"; rm -f "$dir/tty"
wait_for 5 field_is .state status connecting
start_sim --profile steady --speed 1
wait_for 10 field_above .log.rows status 5
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"
log_text "$dir"/log/*.csv >"$dir/live.csv"
[ "$(grep -vc '^#' "$dir/live.csv")" -ge 6 ] || fail "too few rows: $(cat "$dir/live.csv")"
replay=()
for file in "$dir"/capture/*.pcap; do replay+=(--replay "$file"); done
for run in a b; do
  prismd "$dir/gyro.json" "${replay[@]}" --out "$dir/$run" >"$dir/summary"
  log_text "$dir/$run"/*.csv >"$dir/$run.csv"
  cmp "$dir/live.csv" "$dir/$run.csv" || { diff "$dir/live.csv" "$dir/$run.csv" | head -5; fail "the log of the replay differs"; }
done
contains "summary" "$(cat "$dir/summary")" "replayed"
