# SPDX-License-Identifier: MIT
# A thermometer in the chamber's air leads the gyro by an hour: train finds the response without being told, another day
# of the same gyro is corrected, and the log marks the seconds until the response has settled. A gyro with its thermometer
# inside gets no response by chance: without U, this day would have one of 36 min (13 to 73).
. "$(dirname "$0")/lib.sh"
echo '{"name": "g", "frames": "second-means", "clock": "device", "accept_clock": true, "site": {"latitude_deg": 34.25, "elevation_deg": 90}}' >g.json
day() { prismsim --frames second-means --rate 1 --profile paper "${@:2}" --seed "$1" --out "$1.pcap" 2>/dev/null && prismd g.json --replay "$1.pcap" --out "day$1" >/dev/null; }
day 71 --in-air && day 72 --in-air || fail "the replays"
train() { prismcal train day71 --out "$@" >/dev/null 2>train.err || fail "training: $(cat train.err)"; }
gain() { prismcal evaluate "$1" day72 | sed -n 's/^day72: the model removes \([0-9]*\)\..*/\1/p'; }
train auto.json
grep -q "the gyro follows this thermometer in [567][0-9] min" train.err || fail "no response: $(cat train.err)"
jq -e '.version == 3 and .features.response_s.T > 3000 and .features.response_s.T < 4800' auto.json >/dev/null || fail "the response: $(jq -c .features auto.json)"
train none.json --response 0
jq -e '.version < 3 and (.features | has("response_s") | not)' none.json >/dev/null || fail "--response 0: $(jq -c .features none.json)"
found=$(gain auto.json) measured=$(gain none.json)
echo "improvement of another day: $found %, with the temperature as measured $measured %"
[ "$found" -ge 50 ] && [ "$((found - measured))" -ge 15 ] || fail "found $found and $measured %, expected at least 50, and 15 more"
prismd g.json --model ./auto.json --replay 72.pcap --out served >/dev/null || fail "the served replay"
settling=$(grep -hv '^#' served/*.csv | grep -c ',settling,\|,settling$\|"settling') response=$(jq .features.response_s.T auto.json)
[ "$settling" -gt "$((3 * response - 300))" ] && [ "$settling" -lt "$((3 * response + 300))" ] || fail "found $settling rows that settle, expected three times $response"
day 1 && prismcal train day1 --inputs T,dTdt --out inside.json >/dev/null 2>train.err || fail "training: $(cat train.err)"
grep -q "the gyro follows this thermometer at once" train.err || fail "a response inside: $(cat train.err)"
