# SPDX-License-Identifier: MIT
# prismd is killed with SIGKILL: verify names the open and the truncated segment. The repaired copy is intact and has every complete
# row once; train, evaluate and allan can read it.
. "$(dirname "$0")/lib.sh"
PATH=$PRISM_BIN/tools/prismcal:$PATH
frames 20
config '"site": {"latitude_deg": 45, "elevation_deg": 30}, "capture": {"directory": "'"$dir"'/log/capture"}'
start_sim --profile second --speed 20
verify() { code=0; prismcal verify "$@" >"$dir/verify" 2>"$dir/verify.err" || code=$?; }

start_prismd
wait_for 20 field_above .log.rows status 40
verify "$dir/log" "$dir/gyro.json"
same "exit code while prismd writes ($(cat "$dir/verify"))" "$code" 0
contains "the open segment" "$(cat "$dir/verify")" ": open: "
contains "the configuration" "$(cat "$dir/verify")" ": whole: configuration of gyro"
kill -9 "$prismd"; wait "$prismd" 2>/dev/null || true
torn=$(ls "$dir"/log/*.csv | tail -1)  # the last one, if a day ended meanwhile
start_prismd
wait_for 20 field_above .log.rows status 40
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"

printf '2026-11-22T00:' >>"$torn"   # an incomplete row, as after a power failure
verify "$dir/log"
same "exit code after kill -9" "$code" 1
contains "the truncated segment" "$(cat "$dir/verify")" "$torn: torn: "
rows=$(cat "$dir"/log/*.csv | grep -c '^[0-9].*,[01]$')
sums=$(cat "$dir"/log/*.csv "$dir"/log/capture/*.pcap | sha256sum)

verify "$dir/log" --repair "$dir/clean"
same "exit code of the repair ($(cat "$dir/verify.err"))" "$code" 0
contains "the omitted bytes" "$(cat "$dir/verify")" "left out: 14 bytes of an incomplete row"
same "checksum of the original" "$(cat "$dir"/log/*.csv "$dir"/log/capture/*.pcap | sha256sum)" "$sums"
same "rows of the copy" "$(cat "$dir"/clean/*.csv | grep -c '^[0-9].*,[01]$')" "$rows"
[ "$(ls "$dir"/clean/capture/*.pcap | wc -l)" -ge 2 ] || fail "captures: $(ls -R "$dir/clean")"
verify "$dir/clean"
same "exit code of the copy ($(cat "$dir/verify"))" "$code" 0
verify "$dir/log" --repair "$dir/clean"
same "exit code for an existing target" "$code" 1
verify "$dir/log" --repair "$dir/log/clean"
same "exit code for a target inside the log directory" "$code" 1

prismcal train "$dir/clean" --force --method ls --inputs T --window 5 --end-mean 2 --max-gap 2 --out "$dir/model.json" >"$dir/train" 2>&1 ||
  fail "train: $(cat "$dir/train")"
prismcal evaluate "$dir/model.json" "$dir/clean" --in-sample --json >"$dir/evaluate" 2>"$dir/evaluate.err" || fail "evaluate: $(cat "$dir/evaluate.err")"
prismcal allan "$dir/clean" --json >"$dir/allan" 2>"$dir/allan.err" || fail "allan: $(cat "$dir/allan.err")"
[ "$(grep -c 'without an end' "$dir/train" "$dir/allan.err" | grep -vc ':0$')" = 0 ] || fail "the copy has a truncated segment: $(cat "$dir/train")"
