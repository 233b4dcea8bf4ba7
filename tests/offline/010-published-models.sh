# SPDX-License-Identifier: MIT
# The science end to end: a virtual gyro with a known bias through one thermal cycle of the paper, compensated with the
# paper's two published models. The limits hold for several seeds.
. "$(dirname "$0")/../system/lib.sh"
frames 2
models=$PRISM_SOURCE/config/models
within() { awk -v x="$2" -v lo="$3" -v hi="$4" 'BEGIN {exit !(x > lo && x < hi)}' || fail "$1: found $2, expected within $3 to $4"; }
for seed in 1 2; do
  prismsim --profile paper --frames "$dir/frames.json" --seed "$seed" --out "$dir/$seed.pcap" --truth "$dir/$seed.csv" 2>/dev/null
  for model in 1 2; do
    echo '{"frames": "./frames.json", "clock": "device", "name": "g"}' >"$dir/gyro.json"
    prismd "$dir/gyro.json" --replay "$dir/$seed.pcap" --model "$models/tao2019-model$model.json" --out "$dir/$seed-$model" >"$dir/summary"
    read -r raw corrected < <(sed -n 's/.*raw \([0-9.]*\) deg.h, corrected \([0-9.]*\) deg.h.*/\1 \2/p' "$dir/summary")
    echo "seed $seed model $model: raw $raw corrected $corrected"
    within "raw stability" "$raw" 0.013 0.024
    if [ "$model" = 1 ]; then within "model 1" "$corrected" 0.011 0.018; else within "model 2" "$corrected" 0.007 0.0125; fi
  done
done
# The correction of prismd compared with the simulated truth, each second.
python3 - "$dir" <<'END' || fail "see above"
import csv, glob, statistics, sys
folder = sys.argv[1]
def rows(path):
    with open(path) as f: yield from csv.DictReader(line for line in f if not line.startswith("#"))
truth = [float(r["bias_deg_per_h"]) for r in rows(folder + "/2.csv")]
log = [r for path in sorted(glob.glob(folder + "/2-2/*.csv")) for r in rows(path)]
first = int(log[0]["time_s"])
pairs = [(truth[int(r["time_s"]) - first], float(r["bias_deg_per_h"])) for r in log
         if r["bias_deg_per_h"] and int(r["time_s"]) - first < len(truth)]
n = len(pairs); assert n > 92000, n
before, after = statistics.stdev(t for t, _ in pairs), statistics.stdev(t - b for t, b in pairs)
print(f"true bias: 1 sigma {before:.5f} deg/h, left {after:.5f}")
assert after < 0.6 * before, (before, after)
END
