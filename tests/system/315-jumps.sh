# SPDX-License-Identifier: MIT
# A temperature that jumps by 20 degC and stays is an event, and `caution` in `status`.
. "$(dirname "$0")/lib.sh"
seq 1 3000 | awk 'BEGIN { print "t,rate,temperature" } { print 1700000000 + $1 ",8," ($1 > 300 ? 45 : 25) + 0.001 * ($1 % 2) }' >"$dir/jump.csv"
prismcal convert "$dir/jump.csv" --map rate=rate:deg/h,temperature=temperature:degC,time=t:s --out "$dir/jump.pcap" >/dev/null 2>&1
echo "{\"name\": \"gyro\", \"line\": {\"device\": \"/dev/null\"}, \"frames\": \"$PRISM_SOURCE/config/frames/second-means.json\",
  \"model\": \"$PRISM_SOURCE/tests/replay/frames/models/T.json\", \"clock\": \"device\", \"socket\": {\"path\": \"$PRISM_SOCKET\"}}" >"$dir/gyro.json"
start replay prismd "$dir/gyro.json" --replay "$dir/jump.pcap" --speed 100 --socket "$PRISM_SOCKET" --out "$dir/log"
jumped='temperature jumped from 2.* to 45.* and stayed: a fault, or true'
stated() { prismctl status | grep -q "$jumped"; }
wait_for 20 stated
wait_for 20 field_is .quality status good  # the window after the seconds that were left out
same "health" "$(field .health.state status)" caution
prismctl events >"$dir/events"
grep -q "$jumped" "$dir/events" || fail "no event: $(cat "$dir/events")"
