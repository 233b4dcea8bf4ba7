# SPDX-License-Identifier: MIT
# A real gyro in a real chamber through the whole chain: CSV, training, evaluation; then the same record as frames in a
# capture, replayed by prismd, and the log evaluated: the same numbers. The room record is nothing to compensate.
. "$(dirname "$0")/lib.sh"
PATH=$PRISM_BIN/tools/prismcal:$PATH
data=${PRISM_SHARED:-$PRISM_SOURCE/../shared}/data
[ -f "$data/mems_chamber_tofupilot.csv" ] || skip "no $data; set PRISM_SHARED to run this test"
cd "$dir"
map() { echo "rate=rate_$1_dps:deg/s,temperature=temperature_C:degC,time=t_s:s"; }

prismcal train "$data/mems_chamber_tofupilot.csv" --map "$(map x)" --no-earth-rate --inputs T,dTdt --method stepwise --out x.json >train.out 2>train.err
prismcal evaluate x.json "$data/mems_chamber_tofupilot.csv" --map "$(map x)" --no-earth-rate --max-bias 1000 --out report --json >direct.json
# The README of the record: 1 sigma of axis x is 22.8 deg/h in 10 s means; second-order models take off some 65 %.
number() { jq -r ".tables.r1_stability.rows[$2][$3].text" "$1"; }
before=$(number direct.json 0 2) improvement=$(number direct.json 1 5)
awk -v b="$before" -v i="$improvement" 'BEGIN { exit !(b > 20 && b < 26 && i > 60 && i < 80) }' || fail "before $before, improvement $improvement"

# The report needs nothing else, and its three texts agree.
for text in report.html report.csv; do contains "$text" "$(grep -F "$improvement" "report/$text")" "$improvement"; done
! report_text report/report.html | grep -E 'src=|https?://[^w]' || fail "the page needs the network"
for text in html csv json; do ! report_text report/report.$text | grep -iw nan || fail "NaN in report.$text"; done

prismcal convert "$data/mems_chamber_tofupilot.csv" --map "$(map x)" --frames "$PRISM_SOURCE/config/frames/second-means.json" --out x.pcap
cat >real.json <<END
{"frames": "$PRISM_SOURCE/config/frames/second-means.json", "model": "$dir/x.json",
 "correction": {"max_bias_deg_per_h": 1000}}
END
prismd real.json --replay x.pcap --out replayed >replay.out 2>replay.err
prismcal evaluate x.json replayed --config real.json --no-earth-rate --json >replayed.json
# The log rounds to 1e-6 deg/h, 1e-5 degC and 1e-8 degC/s: nothing may differ by more than that makes of it.
for table in r1_stability r1_segments r1_hysteresis; do
  apart=$(jq -n --slurpfile a direct.json --slurpfile b replayed.json --arg t $table \
    '[[$a[0].tables[$t].rows[][].value], [$b[0].tables[$t].rows[][].value]] | transpose | map((((.[0] // 0) - (.[1] // 0)) | fabs) - 1e-6 * ((.[0] // 0) | fabs)) | max')
  awk -v d="$apart" 'BEGIN { exit !(d < 5e-5) }' || fail "$table differs by $apart"
  same "rows of $table" "$(jq ".tables.$table.rows | length" replayed.json)" "$(jq ".tables.$table.rows | length" direct.json)"
done

# A bias beyond the limit is not believed: evaluate leaves such blocks out and counts them, and refuses where none is left,
# as with the usual limit here.
prismcal evaluate x.json "$data/mems_chamber_tofupilot.csv" --map "$(map x)" --no-earth-rate --max-bias 240 --json >limited.json
contains "caption" "$(jq -r .tables.r1_stability.caption limited.json)" "15 further blocks are left out"
! prismcal evaluate x.json "$data/mems_chamber_tofupilot.csv" --map "$(map x)" --no-earth-rate >none.out 2>none.err || fail "believed a bias beyond the limit"
contains "refusal" "$(cat none.err)" "above 100 deg/h in 42 of 42 blocks"

# What prismd itself subtracted is what the workbench says.
log=$(echo replayed/*.csv)
corrected=$(grep -v '^#' "$log" | awk -F, 'NR == 1 { for (i = 1; i <= NF; ++i) c[$i] = i } NR > 1 && $c["bias_deg_per_h"] != "" { ++n } END { print n + 0 }')
[ "$corrected" -gt 4000 ] || fail "prismd corrected $corrected seconds only"

for axis in x y z; do
  ! prismcal train "$data/mpu6050_roomtemp_sunsided.csv" --map "$(map $axis)" --no-earth-rate --inputs T --method ls --out room.json >room.out 2>room.err || fail "trained on a room"
  contains "room, axis $axis" "$(cat room.err)" "nothing to compensate"
  [ ! -e room.json ] || fail "a refused training left a model"
done
