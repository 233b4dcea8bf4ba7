# SPDX-License-Identifier: MIT
# A record of a real gyro in a temperature chamber: training and evaluation from CSV, and from the log of a replay of the
# same record as a capture, give the same numbers. Training on a record at room temperature fails: nothing to compensate.
. "$(dirname "$0")/lib.sh"
data=${PRISM_SHARED:-$PRISM_SOURCE/../shared}/data
[ -f "$data/mems_chamber_tofupilot.csv" ] || skip "no $data; set PRISM_SHARED to run this test"
map() { echo "rate=rate_$1_dps:deg/s,temperature=temperature_C:degC,time=t_s:s"; }

prismcal train "$data/mems_chamber_tofupilot.csv" --map "$(map x)" --no-earth-rate --inputs T,dTdt --method stepwise --out x.json >train.out 2>train.err
prismcal evaluate x.json --in-sample "$data/mems_chamber_tofupilot.csv" --map "$(map x)" --no-earth-rate --max-bias 1000 --out report --json >direct.json
# The README of the record: 1 sigma of axis x is 22.8 deg/h in 10 s means; second-order models remove about 65 %.
number() { jq -r ".tables.r1_stability.rows[$2][$3].text" "$1"; }
before=$(number direct.json 0 2) improvement=$(number direct.json 1 5)
awk -v b="$before" -v i="$improvement" 'BEGIN { exit !(b > 20 && b < 26 && i > 60 && i < 80) }' || fail "before $before, improvement $improvement"

# The report needs no network and contains no NaN; HTML and CSV have the same improvement as the JSON output.
for text in report.html tables/r1_stability.csv; do contains "$text" "$(grep -F "$improvement" "report/$text")" "$improvement"; done
! grep -E 'src=|https?://[^w]' report/report.html || fail "the report refers to the network"
! grep -iwr nan report || fail "NaN in the report"

prismcal convert "$data/mems_chamber_tofupilot.csv" --map "$(map x)" --frames "$PRISM_SOURCE/config/frames/second-means.json" --out x.pcap
cat >real.json <<END
{"frames": "$PRISM_SOURCE/config/frames/second-means.json", "model": "$dir/x.json",
 "correction": {"max_bias_deg_per_h": 1000}}
END
prismd real.json --replay x.pcap --out replayed >replay.out 2>replay.err
prismcal evaluate x.json --in-sample replayed --config real.json --no-earth-rate --json >replayed.json
# The log rounds to 1e-6 deg/h, 1e-5 degC and 1e-8 degC/s: values may differ only by the effect of this rounding.
for table in r1_stability r1_segments; do
  apart=$(jq -n --slurpfile a direct.json --slurpfile b replayed.json --arg t $table \
    '[[$a[0].tables[$t].rows[][].value], [$b[0].tables[$t].rows[][].value]] | transpose | map((((.[0] // 0) - (.[1] // 0)) | fabs) - 1e-6 * ((.[0] // 0) | fabs)) | max')
  awk -v d="$apart" 'BEGIN { exit !(d < 5e-5) }' || fail "$table differs by $apart"
  same "rows of $table" "$(jq ".tables.$table.rows | length" replayed.json)" "$(jq ".tables.$table.rows | length" direct.json)"
done

# evaluate excludes and counts blocks with a bias above the limit. It fails if no block remains, as with the default limit
# of 100 deg/h here.
prismcal evaluate x.json --in-sample "$data/mems_chamber_tofupilot.csv" --map "$(map x)" --no-earth-rate --max-bias 240 --json >limited.json
contains "caption" "$(jq -r .tables.r1_stability.caption limited.json)" "15 more blocks are left out"
! prismcal evaluate x.json --in-sample "$data/mems_chamber_tofupilot.csv" --map "$(map x)" --no-earth-rate >none.out 2>none.err || fail "evaluate accepted a bias above the limit"
contains "error" "$(cat none.err)" "above 100 deg/h in 42 of 42 blocks"

# prismd itself corrected most seconds.
log=$(echo replayed/*.csv)
corrected=$(grep -v '^#' "$log" | awk -F, 'NR == 1 { for (i = 1; i <= NF; ++i) c[$i] = i } NR > 1 && $c["bias_deg_per_h"] != "" { ++n } END { print n + 0 }')
[ "$corrected" -gt 4000 ] || fail "prismd corrected $corrected seconds, expected more than 4000"

for axis in x y z; do
  ! prismcal train "$data/mpu6050_roomtemp_sunsided.csv" --map "$(map $axis)" --no-earth-rate --inputs T --method ls --out room.json >room.out 2>room.err || fail "training on a record at room temperature succeeded"
  contains "room, axis $axis" "$(cat room.err)" "nothing to compensate"
  [ ! -e room.json ] || fail "the failed training wrote a model"
done
