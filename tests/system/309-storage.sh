# SPDX-License-Identifier: MIT
# --check, status and config state what log and capture will keep, before there are data.
. "$(dirname "$0")/lib.sh"
check() { jq ".log = $1 | .capture = $2" "$dir/gyro.json" >"$dir/c.json"; prismd "$dir/c.json" --check >"$dir/o" 2>&1 || fail "--check: $(cat "$dir/o")"; }
config
check '{"keep_days": 365}' '{"keep_mib": 10240, "keep_days": 30}'
contains "the log" "$(cat "$dir/o")" "log: keeps 365 days, 5.0 GiB (keep_days)"
contains "the capture" "$(cat "$dir/o")" "capture: keeps 12.9 days at 200 frames/s, 10.0 GiB (keep_mib, before keep_days 30)"
check '{"keep_mib": 1000}' '{"keep_days": 30}'
contains "only days" "$(cat "$dir/o")" "capture: keeps 30.0 days at 200 frames/s, 23.2 GiB (keep_days)"
contains "only MiB" "$(cat "$dir/o")" "log: keeps 71.4 days, 1.0 GiB (keep_mib, before keep_days 3650)"
frames 400
check '{"directory": "'"$dir"'"}' '{"directory": "'"$dir"'/new/capture", "keep_days": 36500}'
contains "400 frames/s" "$(cat "$dir/o")" "at 400 frames/s"
contains "too little space" "$(cat "$dir/o")" "warning: capture: $dir/new/capture: needs "
frames 200
check '{"directory": "/dev/null/x"}' '{"directory": "/proc/x", "keep_mib": 10240}'
contains "below a device" "$(cat "$dir/o")" "warning: log: /dev/null/x: cannot be created: /dev/null is not a directory"
contains "below /proc" "$(cat "$dir/o")" "warning: capture: /proc/x: cannot be created: /proc is a file system without storage"
check '{"directory": "'"$dir/gyro.json"'"}' '{"keep_days": 30}'
contains "a file" "$(cat "$dir/o")" "warning: log: $dir/gyro.json: cannot be written: it is not a directory"

jq '.capture = {"directory": "'"$dir"'/capture", "keep_days": 30}' "$dir/gyro.json" >"$dir/c.json" && mv "$dir/c.json" "$dir/gyro.json"
start_sim --profile steady --speed 1
start_prismd
contains "status" "$(prismctl status)" "30.0 days at 200 frames/s, 23.2 GiB (keep_days)"
same "config" "$(field '.capture | "\(.keep_mib) \(.keep_days) \(.segment_mib) \(.when_full)"' config)" "null 30 64 stop"
