# SPDX-License-Identifier: MIT
# Replay goldens of the shipped frame descriptions and those in frames/described: prismsim made frames/NAME.pcap from the
# description; its replay must equal frames/NAME.expected. The captures have at most 10 frames a second, so that twelve
# seconds are small; the bytes of a frame are those at full speed. Real bytes of the device, if present, must give
# frames/NAME.real.expected at the described rate.
# usage: shipped.sh NAME | shipped.sh NAME FILE-OF-REAL-BYTES (in ../shared/frames, or where PRISM_SHARED says)
# PRISM_REGENERATE=1 rewrites the expected logs, PRISM_REGENERATE=captures the captures too; read the diff as code.
. "$(dirname "$0")/../system/lib.sh"
. "$PRISM_SOURCE/tests/replay/slow_motion.sh"
name=$1
here=$PRISM_SOURCE/tests/replay/frames
description=$PRISM_SOURCE/config/frames/$name.json
damage=5e-4
[ -e "$description" ] || { description=$here/described/$name.json; damage=5e-3; }

# A model of 5 s that takes in what the description has: T and U, T, or no model at all.
model() {
  local inputs=
  ! grep -q '^  "temperature":' "$description" || inputs=T
  ! grep -q '^  "uhfo":' "$description" || inputs+=U
  case "$inputs" in T | TU) echo ", \"model\": \"$here/models/$inputs.json\"" ;; esac
}

if [ $# -eq 2 ]; then
  capture=${PRISM_SHARED:-$PRISM_SOURCE/../shared}/frames/$2
  expected=$here/$name.real.expected
  cp "$description" "$dir/frames.json"
  [ -e "$capture" ] || skip "no $capture; set PRISM_SHARED to run this test"
  case "$capture" in *.hex) sed 's/#.*//' "$capture" | xxd -r -p >"$dir/bytes"; capture=$dir/bytes ;; esac
else
  capture=$here/$name.pcap
  expected=$here/$name.expected
  slow_motion "$description" >"$dir/frames.json"
  if [ "${PRISM_REGENERATE:-}" = captures ]; then
    prismsim --profile second --hours 0.0034 --lose-frames 0.02 --damage-bytes "$damage" --frames "$dir/frames.json" \
      --out "$capture" 2>"$dir/prismsim.err" || fail "prismsim: exit code $?"
  fi
  [ -e "$capture" ] || fail "$name: no capture; PRISM_REGENERATE=captures makes it (ctest -R replay.frames.$name)"
  [ "$(stat -c %s "$capture")" -le 60000 ] || fail "$capture: found $(stat -c %s "$capture") bytes, expected at most 60000"
fi
echo "{\"name\": \"$name\", \"frames\": \"$dir/frames.json\", \"clock\": \"host\"$(model)}" >"$dir/gyro.json"
prismd "$dir/gyro.json" --replay "$capture" --out "$dir/log" >"$dir/summary" 2>"$dir/prismd.err" || fail "exit code $?"
{
  cat "$dir"/log/*.csv | sed '1s/^# prism [^ ]*/# prism VERSION/; s/^# log: [0-9a-f]*/# log: ID/; s/^\(# end: .*sha256\) .*/\1 SUM/'
  sed -n '1s/^replayed \([0-9]* frames\).*million\/s)/# \1/p' "$dir/summary"
} >"$dir/found"
[ -z "${PRISM_REGENERATE:-}" ] || cp "$dir/found" "$expected"
[ -e "$expected" ] || fail "$name: no $expected; PRISM_REGENERATE=1 makes it"
diff -u "$expected" "$dir/found" >"$dir/diff" || { head -40 "$dir/diff"; fail "$name: the log differs from $expected"; }
