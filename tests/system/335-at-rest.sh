# SPDX-License-Identifier: MIT
# A bias that moved since the training: at rest the Earth rate is known, so health, status and metrics name it, and nothing is corrected by it;
# prismcal evaluate distinguishes a shift and a trend from a wrong standard deviation.
. "$(dirname "$0")/lib.sh"
frames 2
site='"site": {"latitude_deg": 34.25, "elevation_deg": 90}'
echo '{"frames": "./frames.json", "clock": "device", "name": "g", '"$site"'}' >train.json
prismsim --profile paper --frames frames.json --seed 1 --out 1.pcap 2>/dev/null
prismd train.json --replay 1.pcap --out cycle1 >/dev/null
prismcal train cycle1 --quiet --out model.json >train.out
config "$site"
jq '.model = "./model.json"' gyro.json >m.json && mv m.json gyro.json

# run OPTION...: a gyro that is at rest at 25 degC for three quarters of an hour.
run() {
  start_sim --profile steady --speed 200 --seed 2 "$@"
  start_prismd
  wait_for 60 field_above '.log.rows' status 2700
  prismctl --json status >status.json
  prismctl status >status.out
  prismctl metrics >metrics.out
  kill "$prismd" "$sim"; wait "$prismd" "$sim" || true
  rm -rf log tty
}
rest() { jq -r ".at_rest$1" status.json; }

run --turn-on 1
same "quality" "$(jq -r .quality status.json)" good
same "health with another bias" "$(jq -r .health.state status.json)" caution
contains "problem" "$(jq -r '.health.problems[]' status.json)" "deg/h from the Earth rate; model and mount explain ±0.01"
same "the difference is of the corrected rate" "$(jq '(.at_rest.difference_deg_per_h - (.window.corrected_mean_deg_per_h - .at_rest.earth_rate_deg_per_h)) | fabs < 0.05' status.json)" true
same "at rest for half an hour" "$(rest .seen_s)" 1800
contains "status" "$(grep "^at rest" status.out)" "deg/h from the Earth rate, over 1800 s"
contains "metrics" "$(cat metrics.out)" "prism_earth_rate_difference_sd_degrees_per_hour{"

run
same "health with the bias of the training" "$(jq -r .health.state status.json)" good
same "difference within 3 sd" "$(rest ' | (.difference_deg_per_h | fabs) < 3 * .sd_deg_per_h and .sd_deg_per_h < 0.02')" true

# evaluated OPTION...: the sentences on another recording.
evaluated() {
  prismsim --profile paper --frames frames.json --seed 3 --out 3.pcap "$@" 2>/dev/null
  rm -rf cycle3
  prismd train.json --replay 3.pcap --out cycle3 >/dev/null
  prismcal evaluate model.json cycle3 2>evaluate.err | sed -n 1p
}
contains "a shift" "$(evaluated --turn-on 0.2)" " deg/h since the training; the shape fits."
frames 1
contains "a trend of 20 cycles" "$(evaluated --ageing 0.002 --cycles 20)" "The bias drifts by +0.00"
