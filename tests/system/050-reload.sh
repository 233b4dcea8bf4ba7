# SPDX-License-Identifier: MIT
# A reload takes over a good model, refuses a bad one with one line and keeps the old, by request and by SIGHUP.
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
same "exit code of a refused reload" "$code" 1
contains "refusal" "$(cat "$dir/e")" "m.json:/id: found"
same "model after a refusal" "$(field .id model)" "$old"
same "quality after a refusal" "$(field .sample.quality status)" good
cp "$models/tao2019-model1.json" "$dir/m.json"
prismctl reload >"$dir/o"
contains "reload" "$(cat "$dir/o")" "stepwise model 1"
same "quality right after it: the window stays" "$(wait_for 5 field_is .sample.quality status good; field .sample.quality status)" good
cp "$models/tao2019-model2.json" "$dir/m.json"
kill -HUP "$prismd"
wait_for 5 field_is .id model "$old"
echo '{"lime": 1}' >"$dir/gyro.json"
kill -HUP "$prismd"
wait_for 5 grep -q 'reload failed' "$dir/prismd.err"
same "model after a bad configuration" "$(field .id model)" "$old"
kill -0 "$prismd" || fail "the daemon ended"
segments=$(ls "$dir"/log/*.csv | wc -l)
[ "$segments" -ge 2 ] || fail "found $segments log segments, expected one for each model"
