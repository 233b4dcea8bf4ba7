# SPDX-License-Identifier: MIT
# One word for an instance's state. A model that cannot be used does not stop a start: uncorrected rates are recorded, and the alarm names the file.
. "$(dirname "$0")/lib.sh"
frames 50
config
start_sim --profile steady --speed 20
good=$PRISM_SOURCE/config/models/tao2019-model2.json
head -c 500 "$good" >"$dir/model.json"
jq ".model = \"$dir/model.json\"" "$dir/gyro.json" >"$dir/m.json" && mv "$dir/m.json" "$dir/gyro.json"
for option in --strict --check; do
  code=0; prismd "$dir/gyro.json" $option >"$dir/o" 2>"$dir/e" || code=$?
  same "exit code with $option" "$code" 78
  contains "message with $option" "$(cat "$dir/e")" "model.json"
done
for damage in damaged missing; do
  [ "$damage" = damaged ] || rm "$dir/model.json"
  : >"$dir/prismd.err"
  start_prismd
  wait_for 10 field_above .log.rows status 20
  same "health, $damage model" "$(field .health.state status)" failed
  contains "problems, $damage model" "$(field '.health.problems[]' status)" "model: "
  contains "prismctl status, $damage model" "$(prismctl status | grep -A2 health)" "failed: model: "
  contains "stderr, $damage model" "$(grep -a "rates are recorded uncorrected" "$dir/prismd.err")" "model.json"
  contains "quality, $damage model" "$(field .quality status)" no_model
  code=0; prismctl reload >"$dir/o" 2>&1 || code=$?
  [ "$code" -ne 0 ] || fail "a reload with a $damage model is accepted"
  [ "$damage" = missing ] || { kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"; }
done
cp "$good" "$dir/model.json"
prismctl reload >/dev/null
wait_for 20 field_is .health.state status good
same "problems of a good state" "$(field '.health.problems | length' status)" 0
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"
jq 'del(.model)' "$dir/gyro.json" >"$dir/m.json" && mv "$dir/m.json" "$dir/gyro.json"
start_prismd
wait_for 20 field_is .health.state status caution
contains "without a model" "$(prismctl status | grep -A2 health)" "caution: no model is configured: rates are uncorrected"
kill "$sim"
wait_for 10 field_is .health.state status failed
contains "without the gyro" "$(field '.health.problems[]' status)" "line: "
