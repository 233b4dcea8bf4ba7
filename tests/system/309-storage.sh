# SPDX-License-Identifier: MIT
# --check states how fast log and capture grow and whether their directories can be written, before there are data.
. "$(dirname "$0")/lib.sh"
check() { jq ".log = $1 | .capture = $2" "$dir/gyro.json" >"$dir/c.json"; prismd "$dir/c.json" --check >"$dir/o" 2>&1 || fail "--check: $(cat "$dir/o")"; }
config
check '{"keep_days": 365}' '{"keep_mib": 10240, "keep_days": 30}'
contains "the log" "$(cat "$dir/o")" "log: 15 MB a day"
contains "the capture" "$(cat "$dir/o")" "capture: 829 MB a day"
frames 400
check '{"directory": "'"$dir"'"}' '{"directory": "'"$dir"'/new/capture"}'
contains "400 frames/s" "$(cat "$dir/o")" "capture: 1659 MB a day"
frames 200
check '{"directory": "/dev/null/x"}' '{"directory": "/proc/x", "keep_mib": 10240}'
contains "below a device" "$(cat "$dir/o")" "warning: log: /dev/null/x: cannot be created: /dev/null is not a directory"
contains "below /proc" "$(cat "$dir/o")" "warning: capture: /proc/x: cannot be created: /proc is a file system without storage"
check '{"directory": "'"$dir/gyro.json"'"}' '{"keep_days": 30}'
contains "a file" "$(cat "$dir/o")" "warning: log: $dir/gyro.json: cannot be written: it is not a directory"

jq '.capture = {"directory": "'"$dir"'/capture", "keep_days": 30}' "$dir/gyro.json" >"$dir/c.json" && mv "$dir/c.json" "$dir/gyro.json"
start_sim --profile steady --speed 1
start_prismd
same "config" "$(field '.capture | "\(.keep_mib) \(.keep_days) \(.segment_mib * 1) \(.when_full)"' config)" "null 30 64 stop"
