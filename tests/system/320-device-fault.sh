# SPDX-License-Identifier: MIT
# Intact frames that the description refuses (a failed built-in test), and bytes without a frame: no old value counts as good.
. "$(dirname "$0")/lib.sh"
cat >"$dir/frames.json" <<'END'
{"format": "prism-frames", "version": 1, "name": "bits", "line": {"baud": 9600}, "rate_hz": 20,
 "kinds": [{"name": "line", "after": "0A", "length": {"terminator": "0A", "min": 4, "max": 20}, "text": {"separators": ";", "columns": 3},
   "refuse": [{"field": "status", "mask": "0x80", "value": "0x80"}],
   "fields": {"rate": {"column": 0, "type": "decimal", "unit": "deg/h"}, "T": {"column": 1, "type": "decimal", "unit": "degC"},
     "status": {"column": 2, "type": "hex"}}}],
 "gyro": {"meaning": "rate", "unit": "deg/h", "axes": {"z": "rate"}}, "temperature": {"field": "T"}, "status": {"field": "status"}}
END
cat >"$dir/device.py" <<'END'
import os, sys, time
name, fd = sys.argv[1], os.open(sys.argv[2], os.O_WRONLY)
while True:
    time.sleep(0.05)
    kind = open(name).read().strip()
    os.write(fd, b"noise\n" if kind == "noise" else f"12.5;20.5;{kind}\n".encode())
END
start pty socat "PTY,link=$dir/tty,raw,echo=0" "PTY,link=$dir/far,raw,echo=0"
wait_for 5 test -e "$dir/far"
echo 07 >"$dir/kind"
start device python3 "$dir/device.py" "$dir/kind" "$dir/far"
config '"gyro": {"serial": "B1"}'
jq 'del(.model) | del(.clock)' "$dir/gyro.json" >"$dir/own.json" && mv "$dir/own.json" "$dir/gyro.json"
start_prismd

for kind in 87 noise; do
  echo 07 >"$dir/kind"
  wait_for 10 field_is '.quality | test("no_data") | not' status true
  wait_for 10 field_is '.rate_deg_per_h' bias 12.5
  echo "$kind" >"$dir/kind.new" && mv "$dir/kind.new" "$dir/kind"
  wait_for 10 field_is '.quality' bias no_data
  same "$kind: state of the line" "$(field .state status)" receiving
  same "$kind: rate" "$(field .rate_deg_per_h bias)" null
  same "$kind: the frame is old" "$(field '.age_s > 1' bias)" true
  same "$kind: health" "$(field .health.state status)" failed
  wait_for 20 field_is '.no_rate != null' status true
done
contains "noise" "$(field .no_rate status)" "bytes and no frame of bits"
grep -q "frames of bits with a fault of the device (its description refuses them)" "$dir/prismd.err" || fail "no event for the device's fault"
[ "$(field .line.refused status)" -gt 20 ] || fail "refused frames: $(field .line.refused status)"
