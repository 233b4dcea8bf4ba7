# SPDX-License-Identifier: MIT
# prismcal monitor: a quiet log holds or is too short, an ageing gyro does not hold; a model without its key needs --training; prismd shows the
# verdict on the model in use. prismcal history names the models of a log.
. "$(dirname "$0")/lib.sh"
frames 1
site='"site": {"latitude_deg": 34.25, "elevation_deg": 90}'
echo '{"frames": "./frames.json", "clock": "device", "name": "g", '"$site"'}' >train.json

# cycle NAME OPTION...: a log of the chamber's cycle.
cycle() {
  prismsim --profile paper --frames frames.json --out "$1.pcap" "${@:2}" 2>/dev/null
  prismd train.json --replay "$1.pcap" --out "$1" >/dev/null
}
monitored() { code=0; prismcal monitor "$@" >monitor.out 2>monitor.err || code=$?; }

cycle train --seed 1
prismcal train train --quiet --out model.json >/dev/null
monitored model.json train
same "exit code on one cycle" "$code" 4
contains "one cycle" "$(cat monitor.out)" "too little seen: 26 of "
jq '.monitor.delay_h = 12' model.json >sure.json
monitored sure.json train
same "exit code of a quiet log" "$code" 0
contains "the sentence" "$(sed -n 1p monitor.out)" "holds: 2 days, 26 h at rest, "

cycle aged --seed 2 --cycles 4 --ageing 0.003 --age 30
monitored model.json aged
same "exit code on an aged gyro" "$code" 3
contains "the sentence on an aged gyro" "$(sed -n 1p monitor.out)" "drifted since 2026-01-01: +0."
contains "the cause" "$(cat monitor.out)" "likely cause: an offset at all temperatures"
cycle thermal --seed 2 --cycles 8 --thermal-ageing 0.1
monitored model.json thermal
contains "the cause of another thermal response" "$(cat monitor.out)" "likely cause: a slope over temperature"

jq 'del(.monitor)' model.json >old.json
monitored old.json train
same "exit code without the key" "$code" 1
contains "a model without the key" "$(cat monitor.err)" "has no key monitor; expected it, or --training"
monitored old.json train --training train --out new.json
same "exit code with the recording of the training" "$code" 4
same "the id of the model with the key" "$(jq -r .id new.json)" "$(jq -r .id old.json)"

config "$site"
jq '.model = "./model.json"' gyro.json >m.json && mv m.json gyro.json
start_sim --profile steady --speed 200 --seed 2
start_prismd
wait_for 60 field_above '.log.rows' status 900
kill "$prismd" "$sim"; wait "$prismd" "$sim" || true
prismcal monitor --instance gyro.json >instance.out
contains "the verdict on an instance" "$(cat instance.out)" "too little seen: "
same "the file of the verdict" "$(jq -r '.axes[].verdict' log/monitor.json)" too_little
jq '.axes[].verdict = "drifted" | .axes[].text = "drifted since yesterday"' log/monitor.json >v.json && mv v.json log/monitor.json
rm -f tty
start_sim --profile steady --speed 200 --seed 2
start_prismd
wait_for 20 field_is '.monitor.verdict' status drifted
contains "status" "$(prismctl status)" "drifted since yesterday ("
contains "health" "$(prismctl --json status | jq -r '.health.problems[].text')" "model: drifted since yesterday"
contains "metrics" "$(prismctl metrics)" 'verdict="drifted"} 1'
id=$(jq -r .id model.json)
contains "history" "$(prismcal history log)" "${id:0:12} composite"
