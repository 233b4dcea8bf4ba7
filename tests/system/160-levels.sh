# SPDX-License-Identifier: MIT
# All x86-64 levels of this processor give the same result. GLIBC_TUNABLES hides higher levels from the loader, as on an older
# machine. The same capture and model give the same log, byte for byte, and training gives the same model to 1e-9.
. "$(dirname "$0")/lib.sh"
loader=$(ls /lib*/ld-linux-x86-64.so.2 2>/dev/null | head -1)
[ -n "$loader" ] || skip "needs an x86-64 processor"
frames 2
echo '{"frames": "./frames.json", "clock": "device", "name": "g", "site": {"latitude_deg": 34.25, "elevation_deg": 90}}' >gyro.json
prismsim --profile paper --frames frames.json --hours 8 --seed 5 --out run.pcap 2>sim.err

# at LEVEL COMMAND...: runs the command with the library of that level.
declare -A masked=([x86-64-v4]=x [x86-64-v3]=-AVX512F [baseline]=-AVX512F,-AVX2)
at() { GLIBC_TUNABLES=glibc.cpu.hwcaps=${masked[$1]} "${@:2}"; }

levels=()
for level in x86-64-v4 x86-64-v3 baseline; do
  if [ $level != baseline ] && ! "$loader" --help | grep -q "$level (supported"; then
    echo "not tested: this processor has no $level"
    continue
  fi
  levels+=("$level")
  found=$(LD_TRACE_LOADED_OBJECTS=1 at $level prismd | awk '/libprism-kernels/ {print $3}')
  case $level:$found in
    baseline:*/glibc-hwcaps/*) fail "the loader loaded $found, expected the baseline library" ;;
    baseline:/* | *:*/glibc-hwcaps/$level/*) ;;
    *) fail "the loader loaded '$found', expected the library of $level" ;;
  esac
  at $level prismd gyro.json --replay run.pcap --model "$PRISM_SOURCE/config/models/tao2019-model2.json" --out first-$level >/dev/null
  at $level prismcal train first-$level --method ir-lssvm --weight huber --c 50 --sigma2 0.5 --force --out $level.json --quiet >train.out 2>train.err
  at $level prismd gyro.json --replay run.pcap --model "${levels[0]}.json" --out second-$level >/dev/null
  at $level "$PRISM_BIN/tests/unit_compensation" --gtest_brief=1 --gtest_filter='Kernel.*:LssvmModel.*' >unit.err || fail "unit tests of the kernel at $level"
  at $level "$PRISM_BIN/tests/unit_training" --gtest_brief=1 --gtest_filter='Dense.*' >unit.err || fail "unit tests of the matrices at $level"
done

rows=$(cat "second-${levels[0]}"/*.csv | grep -vc '^#\|warming')
[ "$rows" -gt 20000 ] || fail "found $rows corrected rows, expected more than 20000 (about 8 hours)"
for level in "${levels[@]:1}"; do
  diff -r "second-${levels[0]}" "second-$level" >"$dir/diff.err" || fail "the log at $level differs from that at ${levels[0]}"
  # The largest difference of the numbers in the models, relative to the largest number of the same list.
  off=$(jq -n --slurpfile a "${levels[0]}.json" --slurpfile b "$level.json" '
    [[$a[0], $b[0]] | [.[] | [paths(numbers)]] | .[0][] as $p | {p: ($p | map(select(type == "string"))), x: ($a[0] | getpath($p)), y: ($b[0] | getpath($p))}]
    | group_by(.p) | map((map([.x, -.x] | max) | max) as $size | map((.x - .y) / (if $size == 0 then 1 else $size end) | [., -.] | max) | max) | max')
  awk -v off="$off" 'BEGIN {exit !(off < 1e-9)}' || fail "the model trained at $level differs by $off from that at ${levels[0]}"
  echo "$level and ${levels[0]}: $rows equal rows, models differ by at most $off"
done
