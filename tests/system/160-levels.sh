# SPDX-License-Identifier: MIT
# One result at every instruction level that this processor has: the loader is kept from the levels above, as on an older
# machine. The same capture and model give the same log, byte for byte, and the same training the same model to 1e-9.
. "$(dirname "$0")/lib.sh"
PATH=$PRISM_BIN/tools/prismcal:$PATH
cd "$dir"
loader=$(ls /lib*/ld-linux-x86-64.so.2 2>/dev/null | head -1)
[ -n "$loader" ] || skip "only x86-64 has instruction levels here"
frames 2
echo '{"frames": "./frames.json", "clock": "device", "name": "g", "site": {"latitude_deg": 34.25, "elevation_deg": 90}}' >gyro.json
prismsim --profile paper --frames frames.json --hours 8 --seed 5 --out run.pcap 2>sim.err

# at LEVEL COMMAND...: with the library of that level and no other
declare -A masked=([x86-64-v4]=x [x86-64-v3]=-AVX512F [baseline]=-AVX512F,-AVX2)
at() { GLIBC_TUNABLES=glibc.cpu.hwcaps=${masked[$1]} "${@:2}"; }

levels=()
for level in x86-64-v4 x86-64-v3 baseline; do
  if [ $level != baseline ] && ! "$loader" --help | grep -q "$level (supported"; then
    echo "left out: this processor has no $level"
    continue
  fi
  levels+=("$level")
  found=$(LD_TRACE_LOADED_OBJECTS=1 at $level prismd | awk '/libprism-kernels/ {print $3}')
  case $level:$found in
    baseline:*/glibc-hwcaps/*) fail "the loader took $found at the baseline" ;;
    baseline:/* | *:*/glibc-hwcaps/$level/*) ;;
    *) fail "the loader took '$found' for $level" ;;
  esac
  at $level prismd gyro.json --replay run.pcap --model "$PRISM_SOURCE/config/models/tao2019-model2.json" --out first-$level >/dev/null
  at $level prismcal train first-$level --method ir-lssvm --weight huber --c 50 --sigma2 0.5 --force --out $level.json --quiet >train.out 2>train.err
  at $level prismd gyro.json --replay run.pcap --model "${levels[0]}.json" --out second-$level >/dev/null
  at $level "$PRISM_BIN/tests/unit_compensation" --gtest_brief=1 --gtest_filter='Kernel.*:LssvmModel.*' >unit.err || fail "unit tests of the kernel at $level"
  at $level "$PRISM_BIN/tests/unit_training" --gtest_brief=1 --gtest_filter='Dense.*' >unit.err || fail "unit tests of the matrices at $level"
done

rows=$(cat "second-${levels[0]}"/*.csv | grep -vc '^#\|warming')
[ "$rows" -gt 20000 ] || fail "found $rows corrected rows, expected some 8 hours of them"
for level in "${levels[@]:1}"; do
  diff -r -x "*.index" "second-${levels[0]}" "second-$level" >"$dir/diff.err" || fail "the log at $level differs from that at ${levels[0]}"
  # Every number of the model but its id: the largest difference, in units of the largest number of its list.
  off=$(jq -n --slurpfile a "${levels[0]}.json" --slurpfile b "$level.json" '
    [[$a[0], $b[0]] | [.[] | [paths(numbers)]] | .[0][] as $p | {p: ($p | map(select(type == "string"))), x: ($a[0] | getpath($p)), y: ($b[0] | getpath($p))}]
    | group_by(.p) | map((map([.x, -.x] | max) | max) as $size | map((.x - .y) / (if $size == 0 then 1 else $size end) | [., -.] | max) | max) | max')
  awk -v off="$off" 'BEGIN {exit !(off < 1e-9)}' || fail "the model trained at $level differs by $off from that at ${levels[0]}"
  echo "$level and ${levels[0]}: $rows rows the same, models within $off"
done
