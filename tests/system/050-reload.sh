# SPDX-License-Identifier: MIT
# A reload, by request or SIGHUP, loads a valid model. It rejects an invalid one with a message and keeps the old model.
. "$(dirname "$0")/lib.sh"
frames 50
config
sed -i "s|$PRISM_SOURCE/config/models/tao2019-model2.json|./m.json|" "$dir/gyro.json"
models=$PRISM_SOURCE/config/models
cp "$models/tao2019-model2.json" "$dir/m.json"
start_sim --profile steady --speed 100
start_prismd
wait_for 20 field_is .sample.quality status good
old=$(field .id model)
sed 's/0.646/0.647/' "$models/tao2019-model2.json" >"$dir/m.json"
code=0; prismctl reload 2>"$dir/e" || code=$?
same "exit code of a rejected reload" "$code" 1
contains "error of a rejected reload" "$(cat "$dir/e")" "m.json:/id: found"
same "model after a rejected reload" "$(field .id model)" "$old"
same "quality after a rejected reload" "$(field .sample.quality status)" good
cp "$models/tao2019-model1.json" "$dir/m.json"
prismctl reload >"$dir/o"
contains "reload" "$(cat "$dir/o")" "stepwise model 1"
same "quality right after a reload, which keeps the window" "$(wait_for 5 field_is .sample.quality status good; field .sample.quality status)" good
cp "$models/tao2019-model2.json" "$dir/m.json"
kill -HUP "$prismd"
wait_for 5 field_is .id model "$old"
echo '{"lime": 1}' >"$dir/gyro.json"
kill -HUP "$prismd"
wait_for 5 grep -q 'reload failed' "$dir/prismd.err"
same "model after a bad configuration" "$(field .id model)" "$old"
kill -0 "$prismd" || fail "prismd ended"
segments=$(ls "$dir"/log/*.csv | wc -l)
[ "$segments" -ge 2 ] || fail "found $segments log segments, expected at least 2, one for each model"
