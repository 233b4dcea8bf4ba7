# SPDX-License-Identifier: MIT
# prism.Model, the second implementation of features and models, gives the columns of the log: each model type and policy, two sessions,
# a record that leaves the training range, lost frames, a lag.
. "$(dirname "$0")/lib.sh"
/usr/bin/python3 -c 'import numpy' 2>/dev/null || skip "python3-numpy is not installed (run tools/setup)"
export PYTHONPATH=$PRISM_SOURCE/clients/python PYTHONDONTWRITEBYTECODE=1
echo '{"name": "g", "frames": "trplg", "rate_hz": 2, "clock": "device", "accept_clock": true, "site": {"latitude_deg": 34.25, "elevation_deg": 90}}' >g.json
record() { prismsim --rate 2 --profile "$1" --seed "$2" --hours "$3" --out "$4" ${5:+--lose-frames "$5"} 2>/dev/null; }
record fast 3 6 a.pcap
record second 4 2 b.pcap
record beyond 5 3 c.pcap 0.1
prismd g.json --replay a.pcap --out a >/dev/null || fail "the replay"
train() { local out=$1; shift; prismcal train a --quiet --out "$out.json" "$@" >/dev/null 2>"$out.err" || fail "training $out: $(cat "$out.err")"; }
train lssvm --method lssvm --c 10 --sigma2 1
train ir-lssvm --method ir-lssvm --c 10 --sigma2 1
train svr --method svr
train ls --method ls --inputs T
train lag --method stepwise --inputs T,dTdt,lag1 --lag 1800
prismsim --rate 20 --profile fast --seed 3 --hours 3 --out short.pcap 2>/dev/null
jq '.rate_hz = 20' g.json >g20.json
prismd g20.json --replay short.pcap --out short >/dev/null || fail "the replay"
prismcal train short --quiet --force --out composite.json >/dev/null 2>composite.err || fail "training: $(cat composite.err)"
cat >compare.py <<'END'
import csv, glob, json, sys
import numpy as np
import prism
rows = [row for name in sorted(glob.glob(sys.argv[2] + "/*.csv")) for row in csv.DictReader(line for line in open(name) if not line.startswith("#"))]
number = lambda text: float(text) if text else np.nan
names = ("time_s", "rate_deg_per_h", "temperature_degc", "uhfo_v", "partial")
frame = {name: np.array([number(row[name]) for row in rows]) for name in names} | {"quality": np.array([row["quality"] for row in rows])}
found = prism.Model(sys.argv[1]).predict(frame, sys.argv[3])
outside = np.sum(frame["quality"] == "extrapolating")
assert len(rows) > 15000 and {"warming", "good"} <= set(frame["quality"]), sorted(set(frame["quality"]))
assert outside > (1000 if sys.argv[1] == "composite.json" else 0), f"{outside} rows outside the training range"
# The log's means are rounded to 1e-5 degC: 1e-7 degC/s in a slope.
for name, last in dict(mean_rate_deg_per_h=1e-6, mean_temperature_degc=1e-5, slope_degc_per_s=1e-7, mean_uhfo_v=1e-6, bias_deg_per_h=1e-6,
                       sd_deg_per_h=1e-6, sd_mean_deg_per_h=1e-6, corrected_deg_per_h=1e-6, corrected_mean_deg_per_h=1e-6).items():
    log = np.array([number(row[name]) for row in rows])
    same = np.isnan(log) == np.isnan(found[name])
    assert same.all(), f"{name}: row {np.flatnonzero(~same)[0]} is known in one of both only"
    worst = np.nanmax(np.abs(log - np.round(found[name] / last) * last)) if np.isfinite(log).any() else 0
    assert worst <= 1.01 * last, f"{name}: differs by {worst}"
other = np.flatnonzero(found["quality"] != frame["quality"])
assert not len(other), f"quality: found {found['quality'][other[0]]}, expected {frame['quality'][other[0]]} in row {other[0]}"
END
compare() { # MODEL POLICY
  jq ".correction.extrapolation = \"$2\"" g.json >served.json
  prismd served.json --model "./$1.json" --replay b.pcap --replay c.pcap --out "log-$1-$2" >/dev/null 2>replay.err || fail "$1: $(cat replay.err)"
  /usr/bin/python3 compare.py "$1.json" "log-$1-$2" "$2" || fail "$1, $2"
}
for model in lssvm ir-lssvm svr ls lag composite; do compare "$model" preset; done
for policy in flag clamp shrink; do compare composite "$policy"; compare lssvm "$policy"; done

# A wrong file is one sentence.
wrong() { # TEXT CHANGE
  jq "$2" composite.json >wrong.json
  contains "$2" "$(/usr/bin/python3 -c 'import prism; prism.Model("wrong.json")' 2>&1 | tail -1)" "ValueError: wrong.json: $1"
}
wrong "found prism-model 3, expected prism-model 1 or 2" '.version = 3'
wrong "'beta' is missing" 'del(.beta)'
wrong "'variances' is missing" 'del(.variances)'
wrong "found a number that is not finite" '.alpha[0] = null'
wrong "kind: found forest" '.kind = "forest"'
