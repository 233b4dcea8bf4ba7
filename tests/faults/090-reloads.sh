# SPDX-License-Identifier: MIT
# PRISM_RELOADS reloads (40; long form: 1000) that change the model; one in ten is invalid and its error is reported. No frame is lost,
# and memory and descriptors do not grow.
. "$(dirname "$0")/lib.sh"
reloads=${PRISM_RELOADS:-$(long 40 1000)}
config
cp "$dir/gyro.json" "$dir/good.json"
sed "s/tao2019-model2/tao2019-model1/" "$dir/good.json" >"$dir/other.json"
sed 's/"clock"/"klock"/' "$dir/good.json" >"$dir/bad.json"
start_sim --profile steady --speed 1
start_prismd
wait_for 10 field_is .state status receiving

memory() { awk '/^VmRSS/ { print $2 }' "/proc/$prismd/status"; }
descriptors() { ls "/proc/$prismd/fd" | wc -l; }

refused=0
for i in $(seq "$reloads"); do
  case $((i % 10)) in
    0) cp "$dir/bad.json" "$dir/gyro.json" ;;
    [2468]) cp "$dir/other.json" "$dir/gyro.json" ;;
    *) cp "$dir/good.json" "$dir/gyro.json" ;;
  esac
  code=0; prismctl reload >"$dir/answer" 2>&1 || code=$?
  if [ $((i % 10)) = 0 ]; then
    same "exit code of an invalid reload ($(cat "$dir/answer"))" "$code" 1
    contains "an invalid reload" "$(cat "$dir/answer")" klock
    refused=$((refused + 1))
  else
    same "exit code of reload $i ($(cat "$dir/answer"))" "$code" 0
  fi
  if [ "$i" = $((reloads / 4 > 10 ? reloads / 4 : 10)) ]; then memory_before=$(memory) descriptors_before=$(descriptors); fi
done
echo "$reloads reloads, $refused rejected: $memory_before to $(memory) kB, $descriptors_before to $(descriptors) descriptors"
sanitized || [ "$(memory)" -lt $((memory_before + 2048)) ] || fail "found $(memory) kB, expected at most 2 MB above $memory_before"
[ "$(descriptors)" -le $((descriptors_before + 1)) ] || fail "found $(descriptors) descriptors, expected at most $((descriptors_before + 1))"
same "frames lost" "$(field .timing.missing_frames status)" 0
same "state" "$(field .state status)" receiving
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"
prismcal verify "$dir/log" >"$dir/verify" || fail "the log: $(cat "$dir/verify")"
