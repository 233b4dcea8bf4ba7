# SPDX-License-Identifier: MIT
# Every invalid configuration gives exit code 78 and one line: place, value found, value expected.
. "$(dirname "$0")/lib.sh"
refused() {  # refused WHAT PART-OF-THE-LINE
  code=0
  prismd --strict "$dir/gyro.json" >"$dir/o" 2>"$dir/e" || code=$?
  same "$1: exit code" "$code" 78
  same "$1: lines" "$(wc -l <"$dir/e")" 1
  contains "$1" "$(cat "$dir/e")" "$2"
}
rm -f "$dir/gyro.json"; refused "missing file" "gyro.json: cannot be read: No such file or directory"
echo '{"lime": 1}' >"$dir/gyro.json"; refused "unknown key" "gyro.json:/lime: unknown key"
echo '{"line": {"baud": "x"}}' >"$dir/gyro.json"; refused "wrong type" 'gyro.json:/line/baud: found "x", expected an integer'
echo '{"line": {"silence_s": -1}}' >"$dir/gyro.json"; refused "out of range" "gyro.json:/line/silence_s: found -1, expected a number within 0.1 to 3600"
printf '{\n "line": {,}\n}' >"$dir/gyro.json"; refused "invalid JSON" "gyro.json:2:"
long=$(printf 'n%.0s' $(seq 250))
echo "{\"name\": \"$long\", \"socket\": {\"path\": \"\"}}" >"$dir/gyro.json"; refused "name too long" "expected 1 to 90 bytes of printable text"
echo '{"name": "a\nb"}' >"$dir/gyro.json"; refused "newline in the name" 'gyro.json:/name: found "a\nb", expected 1 to 90 bytes of printable text'
echo '{"frames": "nope"}' >"$dir/gyro.json"; refused "missing frames" 'gyro.json:/frames: found "nope", expected one of ascii-columns, '
contains "searched directories" "$(cat "$dir/e")" "; looked for nope.json in $dir/frames, "
echo '{"frames": "./nope.json"}' >"$dir/gyro.json"; refused "missing path" "gyro.json:/frames: $dir/nope.json: cannot be read: No such file or directory"
echo '{"frames": "kvh175"}' >"$dir/gyro.json"; refused "mistyped frames" 'gyro.json:/frames: found "kvh175", did you mean "kvh1750"? Looked for kvh175.json in '
echo '{"model": "tao2019-model3"}' >"$dir/gyro.json"; refused "mistyped model" 'did you mean "tao2019-model'
echo '{"model": "nope"}' >"$dir/gyro.json"; refused "missing model" 'gyro.json:/model: found "nope", expected one of tao2019-model1, '
echo '{}' >"$dir/gyro.json"; refused "no device" "gyro.json:/line/device: is missing"
code=0; prismd --check "$dir/gyro.json" >"$dir/o" 2>"$dir/e" || code=$?; same "exit code of --check" "$code" 78
model=$PRISM_SOURCE/config/models/tao2019-model2.json
echo '{"model": "./m.json", "line": {"device": "/dev/null"}}' >"$dir/gyro.json"
sed 's/"version": 1/"version": 9/' "$model" >"$dir/m.json"; refused "newer model" "m.json:/version: found 9, expected at most 3: made by a newer prism"
sed 's/0.646/0.647/' "$model" >"$dir/m.json"; refused "damaged model" "m.json:/id: found"
head -c 700 "$model" >"$dir/m.json"; refused "truncated model" "m.json:"
sed 's/"serial": ""/"serial": "70-1"/' "$model" >"$dir/m.json"
echo '{"model": "./m.json", "gyro": {"serial": "70-2"}, "line": {"device": "/dev/null"}}' >"$dir/gyro.json"
refused "model of another gyro" 'm.json:/gyro/serial: found "70-1", expected "70-2"'
echo '{"fallback_model": "tao2019-model2", "line": {"device": "/dev/null"}}' >"$dir/gyro.json"
refused "fallback that needs a slope" "needs the input dTdt"
config
prismd "$dir/gyro.json" --check >"$dir/o"; contains "a valid configuration" "$(cat "$dir/o")" "gyro.json: good: frames trplg"
code=0; prismd --nonsense 2>"$dir/e" || code=$?; same "exit code for an unknown option" "$code" 64
