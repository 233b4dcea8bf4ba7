# SPDX-License-Identifier: MIT
# Named sensors: the effect of a gradient, which the thermometer of the axis cannot measure, is learned from the difference to a
# second thermometer (three pairs of seeds, evaluated on another profile). The log has every sensor; a model with a missing sensor is
# rejected.
. "$(dirname "$0")/lib.sh"
sed 's/^\( *"rate_hz": \)[0-9.]*/\110/' "$PRISM_SOURCE/config/frames/stim300.json" >frames.json
echo '{"name": "imu", "frames": "frames.json", "clock": "device", "site": {"latitude_deg": 34.25}, "axes": {"x": {"elevation_deg": 90}}}' >imu.json
record() { # DIRECTORY PROFILE SEED
  prismsim --frames frames.json --axis x --gradient 0.004 --smooth --hours 12 --profile "$2" --seed "$3" --out "$1.pcap" 2>/dev/null
  rm -rf "$1"; prismd imu.json --replay "$1.pcap" --out "$1" >/dev/null || fail "the replay of $1"
}
left() { # INPUTS: prints the remaining drift on the other profile, deg/h
  prismcal train one --inputs "$1" --response 0 --method stepwise --quiet --out model.json >/dev/null || fail "training on $1"
  prismcal evaluate model.json other | awk '$1 == "after" && !seen++ {print $3}'
}
for pair in 1 2 3; do
  record one fast $pair
  record other second $((100 + pair))
  without=$(left T,dTdt) with=$(left T,dTdt,acc_temp_x-T)
  awk -v a="$without" -v b="$with" 'BEGIN {exit !(b > 0 && b <= 0.8 * a)}' ||
    fail "pair $pair: the remaining drift is $without deg/h without the difference and $with deg/h with it, expected at most 80 % of it"
  echo "pair $pair: remaining drift $without deg/h without the difference, $with deg/h with it"
done
prismcal train one --inputs auto --method stepwise --out auto.json 2>auto.err >/dev/null || fail "training with --inputs auto: $(cat auto.err)"
contains "the chosen inputs" "$(jq -r '[.inputs[].name] | join(" ")' auto.json)" "_temp_"
same "reports of the chosen set" "$(grep -c 'chosen: the smallest set' auto.err)" 1
contains "the log's columns" "$(grep -h '^time_utc' one/*.csv)" "arrival_s,sent_deg_per_h,offset_deg_per_h,gyro_temp_x_degc,"
contains "the model" "$(jq -c .features.sensors model.json)" '{"acc_temp_x":"degC"}'

! prismcal export model.json --c c 2>export.err || fail "a model of sensors became C"
contains "its error" "$(cat export.err)" "model.json: has inputs of sensors"
# The same numbers in a table give the same model.
python3 - <<'END'
import csv, glob
with open("table.csv", "w") as out:
    print("time s,rate deg/h,T degC,case K", file=out)
    for name in sorted(glob.glob("one/*.csv")):
        for row in csv.DictReader(line for line in open(name) if not line.startswith("#")):
            if row["partial"] == "0":
                print(row["time_s"], row["rate_deg_per_h"], row["temperature_degc"], float(row["acc_temp_x_degc"]) + 273.15, sep=",", file=out)
END
prismcal train table.csv --map time=1:s,rate=2:deg/h,temperature=3:degC,imu.acc_temp_x=4:K --latitude 34.25 --elevation 90 --inputs T,dTdt,imu.acc_temp_x-T --method stepwise --quiet --out table.json >/dev/null || fail "training on the table"
prismcal convert table.csv --map time=1:s,rate=2:deg/h,temperature=3:degC,imu.acc_temp_x=4:K --out table.pcap >/dev/null 2>convert.err || fail "convert"
contains "what a capture lacks" "$(cat convert.err)" "table.pcap: the frames have rate, temperature and UHFO voltage, but not the sensors imu.acc_temp_x"
same "the sensor" "$(jq -c .features.sensors table.json)" '{"imu.acc_temp_x":"degC"}'
jq -s -e '[.[].terms] | (.[0] | map(.powers)) == (.[1] | map(.powers)) and ([(.[0] | map(.coefficient)), (.[1] | map(.coefficient))] | transpose | all((.[0] / .[1] - 1) | fabs < 1e-6))' model.json table.json >/dev/null || fail "the table gives another model: $(jq -c .terms table.json) instead of $(jq -c .terms model.json)"

jq '.axes.x.model = "./model.json"' imu.json >served.json
prismd served.json --replay other.pcap --out served >summary || fail "the corrected replay"
contains "its summary" "$(cat summary)" "improvement"
prismd served.json --replay other.pcap --out live --speed 500 --socket "$PRISM_SOCKET" >/dev/null 2>live.err &
children+=($!)
has_inputs() { prismctl --json bias | jq -e '.inputs["acc_temp_x-T"] | .unit == "degC" and (.value | type) == "number"' >/dev/null; }
wait_for 20 has_inputs
contains "the inputs of bias" "$(prismctl bias | grep -A1 inputs)" "acc_temp_x-T "
prismcal train one --inputs T,dTdt --method stepwise --serial S1 --quiet --out bound.json >/dev/null || fail "training for a serial number"
jq '.gyro.serial = "S1" | .axes = {y: {elevation_deg: 90, model: "./bound.json"}}' imu.json >other-axis.json
code=0; prismd other-axis.json --check 2>axis.err || code=$?
same "exit code with the model of another axis" "$code" 78
contains "its error" "$(cat axis.err)" 'bound.json:/gyro/axis: found "x", expected "y": the model is of another axis'
code=0; jq 'del(.axes) + {gyro: {axis: "x"}, model: "./model.json"}' imu.json >one.json; prismd one.json --check 2>one.err || code=$?
same "exit code without axes" "$code" 78
contains "its error" "$(cat one.err)" 'found acc_temp_x, expected a sensor of stim300 (sensors need "axes" in the configuration): none'
sed 's/"acc_temp_x": {"field": "acc_temp_x"/"board": {"field": "acc_temp_x"/' frames.json >other.json; mv other.json frames.json
code=0; prismd served.json --check 2>served.err || code=$?
same "exit code without the sensor" "$code" 78
contains "its error" "$(cat served.err)" "found acc_temp_x, expected a sensor of stim300: gyro_temp_x"
code=0; prismcal train one --inputs T,shell-T --out no.json 2>no.err >out || code=$?
contains "its error" "$(cat no.err)" 'found no sensor "shell" of --inputs; its sensors: gyro_temp_x, '
