# SPDX-License-Identifier: MIT
# An unknown line is recognised by listening; descriptions and models are checked alone.
. "$(dirname "$0")/lib.sh"
start_sim --profile steady --speed 1
contains "a live line" "$(prismd --sniff "$dir/tty")" "trplg"
head -c 100000 /dev/urandom >"$dir/noise"
code=0; prismd --sniff "$dir/noise" >"$dir/o" || code=$?
same "exit code for noise" "$code" 1
contains "noise" "$(cat "$dir/o")" "nothing fits"
code=0; prismd --sniff "$dir/none" 2>"$dir/e" || code=$?
same "exit code for nothing" "$code" 1
contains "nothing" "$(cat "$dir/e")" "none: cannot be read"
for file in "$PRISM_SOURCE"/config/frames/*.json; do
  case "$file" in *.schema.json) continue ;; esac
  contains "$file" "$(prismd --check "$file")" "test vectors hold"
done
sed 's/63 4D"/63 4E"/' "$PRISM_SOURCE/config/frames/trplg.json" >"$dir/f.json"
code=0; prismd --check "$dir/f.json" 2>"$dir/e" || code=$?
same "exit code for a vector that does not hold" "$code" 78
contains "model" "$(prismd --check "$PRISM_SOURCE/config/models/tao2019-model1.json")" "good: model"
