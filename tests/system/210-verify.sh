# SPDX-License-Identifier: MIT
# prismd is killed with SIGKILL: verify names the open and the truncated segment; train, evaluate and allan read every complete row.
. "$(dirname "$0")/lib.sh"
frames 20
config '"site": {"latitude_deg": 45, "elevation_deg": 30}, "capture": {"directory": "'"$dir"'/log/capture"}'
start_sim --profile second --speed 20
verify() { code=0; prismcal verify "$@" >"$dir/verify" 2>"$dir/verify.err" || code=$?; }

start_prismd
wait_for 20 field_above .log.rows status 40
verify "$dir/log"
same "exit code while prismd writes ($(cat "$dir/verify"))" "$code" 0
contains "the open segment" "$(cat "$dir/verify")" ": open: "
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
contains "the incomplete row" "$(cat "$dir/verify")" "14 bytes of an incomplete row"
same "rows that verify reads" "$(prismcal verify "$dir/log" --json | jq '[.sessions[].rows] | add')" "$rows"

prismcal train "$dir/log" --force --method ls --inputs T --window 5 --end-mean 2 --max-gap 2 --out "$dir/model.json" >"$dir/train" 2>&1 ||
  fail "train: $(cat "$dir/train")"
prismcal evaluate "$dir/model.json" "$dir/log" --in-sample --json >"$dir/evaluate" 2>"$dir/evaluate.err" || fail "evaluate: $(cat "$dir/evaluate.err")"
prismcal allan "$dir/log" --json >"$dir/allan" 2>"$dir/allan.err" || fail "allan: $(cat "$dir/allan.err")"
contains "the truncated segment, in train" "$(cat "$dir/train")" "without an end"
