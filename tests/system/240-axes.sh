# SPDX-License-Identifier: MIT
# A device with three axes: recorded, trained, replayed and corrected on all axes. The log of each axis equals that of a replay of
# this axis alone, byte for byte. In a live run one axis fails and the others continue; its replay writes the same logs.
. "$(dirname "$0")/lib.sh"
# device NAME: writes its description at 10 frames/s, to make hours of data small.
device() {
  sed 's/^\( *"rate_hz": \)[0-9.]*/\110/' "$PRISM_SOURCE/config/frames/$1.json" >frames.json
  grep -q '^ *"rate_hz": 10,' frames.json || fail "no rate_hz in $1"
}
simulate() { prismsim --frames frames.json --axis x,y,z --elevation 0,0,90 --azimuth 0,90,0 "$@" 2>sim.err || fail "$(cat sim.err)"; }
three() { # FILE MODEL: writes a configuration of three axes. AXIS in MODEL is replaced by the axis; no models if empty
  local axis members="" mount
  for axis in x y z; do
    mount='"elevation_deg": 0'; [ $axis = y ] && mount='"elevation_deg": 0, "azimuth_deg": 90'; [ $axis = z ] && mount='"elevation_deg": 90'
    members+="\"$axis\": {${2:+\"model\": \"$dir/${2/AXIS/$axis}\", }$mount}, "
  done
  echo "{\"name\": \"imu\", \"gyro\": {\"serial\": \"I1\"}, \"frames\": \"$dir/frames.json\", \"clock\": \"device\",
    \"site\": {\"latitude_deg\": 34.25}, \"line\": {\"device\": \"$dir/tty\", \"silence_s\": 1}, \"socket\": {\"path\": \"$PRISM_SOCKET\"},
    \"log\": {\"directory\": \"$dir/live\"}, \"capture\": {\"directory\": \"$dir/bytes\"}, \"axes\": {${members%, }}}" >"$1"
}

for name in vectornav kvh1750 stim300; do
  device $name; rm -rf logs corrected
  simulate --smooth --profile fast --hours 8 --seed 1 --out one.pcap
  simulate --smooth --profile fast --hours 8 --seed 2 --out two.pcap
  three record.json ""
  prismd record.json --replay one.pcap --out logs >record.out || fail "the replay"
  same "logs of $name" "$(ls logs | sed 's/-0.*//' | sort | tr '\n' ' ')" "imu-x imu-y imu-z "
  prismcal train logs --inputs T,dTdt --method stepwise --out model.json >train.out 2>train.err || fail "training: $(tail -3 train.err)"
  same "models" "$(echo model-*.json)" "model-x.json model-y.json model-z.json"
  three all.json model-AXIS.json
  prismd all.json --replay two.pcap --out corrected >summary || fail "the corrected replay of $name"
  for axis in x y z; do
    gain=$(sed -n "s/^$axis: bias stability.*improvement \(.*\) %/\1/p" summary)
    awk -v gain="$gain" 'BEGIN {exit !(gain > 20)}' || fail "axis $axis of $name: found an improvement of '$gain' %, expected more than 20: $(cat summary)"
  done
done

prismcal train one.pcap --config record.json --axis y --inputs T,dTdt --method stepwise --quiet --out y.json >/dev/null || fail "training on the capture"
same "terms of y from the log and from the capture" "$(jq -c "[.terms[].powers]" y.json)" "$(jq -c "[.terms[].powers]" model-y.json)"
code=0; prismcal evaluate model-x.json logs >out 2>axis.err || code=$?
same "exit code for logs of three axes without --axis" "$code" 1
contains "its error" "$(cat axis.err)" "found the axes x, y, z, expected one; choose it with --axis"

# Each axis alone gives the same rows.
for axis in x y z; do
  jq --arg axis $axis '.axes |= {($axis): .[$axis]}' all.json >alone.json
  prismd alone.json --replay two.pcap --out alone-$axis >/dev/null || fail "the replay of $axis alone"
  log_text corrected/imu-$axis-*.csv >a; log_text alone-$axis/imu-$axis-*.csv >b
  cmp a b || fail "the log of $axis differs from that of axis $axis alone"
done

# Live; y is invalid from second 3 on.
wait_for 1 test ! -e tty
start sim prismsim --frames frames.json --axis x,y,z --elevation 0,0,90 --azimuth 0,90,0 --profile steady --link "$dir/tty" --wait --invalid y:3:1e9
wait_for 5 test -e tty
start prismd prismd all.json; daemon=$pid
wait_for 5 prismctl version
wait_for 10 sh -c "prismctl --json status | jq -e '.axes.y.window.quality | contains(\"rate_invalid\")'"
prismctl --json bias >bias.json
same "rate of y" "$(jq .axes.y.rate_deg_per_h bias.json)" null
for axis in x z; do
  same "rate of $axis is a number" "$(jq "(.axes.$axis.rate_deg_per_h | type) + \" \" + .axes.$axis.axis" -r bias.json)" "number $axis"
done
prismctl status >status.out
same "axes of status" "$(awk '/^axis / {printf "%s ", $2}' status.out)" "x y z "
awk 'length($0) > 80 && !/^(line|log|device)/ {exit 1}' status.out || fail "wider than 80 columns: $(cat status.out)"
contains "bias of one axis" "$(prismctl --axis z bias)" "quality"
code=0; prismctl --axis w bias 2>wrong.err || code=$?
contains "an unknown axis" "$(cat wrong.err)" "expected one of x, y, z"
timeout 60 prismctl --json --axis z watch --count 2 >watch.out
same "axes of the rows" "$(jq -r '.params.axis // empty' watch.out | sort -u)" z
timeout 60 prismctl watch --count 6 >rows.out </dev/null
same "axes of the lines" "$(awk '$1 ~ /^[xyz]$/ {print $1}' rows.out | sort -u | tr '\n' ' ')" "x y z "
kill -TERM "$daemon"; wait "$daemon" || fail "exit code $?"
prismd all.json --replay bytes/imu-*.pcap --out again >/dev/null
for axis in x y z; do
  log_text live/imu-$axis-*.csv >a; log_text again/imu-$axis-*.csv >b
  cmp a b || fail "the replay's log of $axis differs from the live one"
done
prismcal verify live >verify.out || fail "verify: $(cat verify.out)"
contains "verify" "$(cat verify.out)" "axis y, session"
