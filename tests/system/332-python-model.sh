# SPDX-License-Identifier: MIT
# prism.Model, the second implementation of features and models, gives the columns of the log: each model type and policy, two sessions,
# a record that leaves the training range, lost frames, a response.
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
train squares --method stepwise --slope least_squares
train response --method stepwise --response 900
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
sensors = [name for name in rows[0] if name.endswith("_degc") and not name.startswith(("temperature", "mean", "slope"))]
frame = {name: np.array([number(row[name]) for row in rows]) for name in (*names, *sensors)} | {"quality": np.array([row["quality"] for row in rows])}
model = prism.Model(sys.argv[1])
found = model.predict(frame, sys.argv[3])
outside = np.sum(frame["quality"] == "extrapolating")
assert len(rows) > 15000 and {"warming", "good"} <= set(frame["quality"]), sorted(set(frame["quality"]))
assert outside >= {"composite.json": 1000, "sparse-lssvm.json": 0, "sparse-composite.json": 0, "sensors.json": 0}.get(sys.argv[1], 1), f"{outside} rows outside the training range"
# The log's means are rounded to 1e-5 degC: 1e-7 degC/s in a slope of 100 s.
for name, last in dict(mean_rate_deg_per_h=1e-6, mean_temperature_degc=1e-5, slope_degc_per_s=1e-5 / model.features["length_s"], mean_uhfo_v=1e-6, bias_deg_per_h=1e-6,
                       sd_deg_per_h=1e-6, sd_mean_deg_per_h=1e-6, corrected_deg_per_h=1e-6, corrected_mean_deg_per_h=1e-6).items():
    log = np.array([number(row[name]) for row in rows])
    same = np.isnan(log) == np.isnan(found[name])
    assert same.all(), f"{name}: row {np.flatnonzero(~same)[0]} is known in one of both only"
    worst = np.nanmax(np.abs(log - found[name])) if np.isfinite(log).any() else 0
    assert worst <= 1.5 * last, f"{name}: differs by {worst}"
other = np.flatnonzero(found["quality"] != frame["quality"])
assert not len(other), f"quality: found {found['quality'][other[0]]}, expected {frame['quality'][other[0]]} in row {other[0]}"
END
compare() { # MODEL POLICY
  jq ".correction.extrapolation = \"$2\"" g.json >served.json
  prismd served.json --model "./$1.json" --replay b.pcap --replay c.pcap --out "log-$1-$2" >/dev/null 2>replay.err || fail "$1: $(cat replay.err)"
  /usr/bin/python3 compare.py "$1.json" "log-$1-$2" "$2" || fail "$1, $2"
}
for model in lssvm ir-lssvm svr ls squares response composite; do compare "$model" preset; done
for policy in flag clamp shrink; do compare composite "$policy"; compare lssvm "$policy"; done

# Many samples, of which some are centres: the models keep a matrix instead of their samples.
sed 's/"rate_hz": 2, "frames": "trplg"/"frames": "second-means"/; s/"frames": "trplg", "rate_hz": 2/"frames": "second-means"/' g.json >long.json
prismsim --frames second-means --rate 1 --profile fast --seed 3 --hours 145 --out long.pcap 2>/dev/null
prismd long.json --replay long.pcap --out long >/dev/null || fail "the replay"
sparse() { # NAME OPTIONS...
  prismcal train long --force --quiet --out "$@" >/dev/null 2>sparse.err || fail "training: $(cat sparse.err)"
  jq -e '(.gram // .uncertainty.gram) | length > 100' "$1" >/dev/null || fail "$1: no gram"
}
sparse sparse-lssvm.json --method lssvm --c 10 --sigma2 1
sparse sparse-composite.json
compare sparse-lssvm preset
compare sparse-composite preset

# A second thermometer.
sed 's/^\( *"rate_hz": \)[0-9.]*/\110/' "$PRISM_SOURCE/config/frames/stim300.json" >frames.json
echo '{"name": "imu", "frames": "frames.json", "clock": "device", "site": {"latitude_deg": 34.25}, "axes": {"x": {"elevation_deg": 90}}}' >imu.json
prismsim --frames frames.json --axis x --gradient 0.004 --smooth --hours 6 --profile fast --seed 1 --out imu.pcap 2>/dev/null
prismd imu.json --replay imu.pcap --out imu >/dev/null || fail "the replay"
train_imu() { prismcal train imu --inputs T,dTdt,acc_temp_x-T,dacc_temp_x/dt --method stepwise --quiet --out sensors.json >/dev/null 2>sensors.err || fail "training: $(cat sensors.err)"; }
train_imu
jq '.axes.x.model = "./sensors.json"' imu.json >served.json
prismd served.json --replay imu.pcap --out log-imu >/dev/null || fail "the replay"
/usr/bin/python3 compare.py sensors.json log-imu preset || fail "sensors"

# Five unknown seconds are bridged. Of six, each window that contains them all is unknown. Unused seconds begin a new window.
/usr/bin/python3 - <<'END' || fail "gaps"
import numpy as np
import prism
time = np.arange(400.0)
frame = dict(time_s=time, rate_deg_per_h=time * 0, temperature_degc=25 + time / 1000, uhfo_v=time * 0 + 5, partial=(time == 330) * 1)
for missing, expected in ((5, []), (6, [*range(205, 300), *range(305, 310)])):
    frame["temperature_degc"][200:200 + missing] = np.nan
    quality = prism.Model("svr.json").predict(frame)["quality"]
    found = [row for row in range(400) if "input_missing" in quality[row]]
    assert found == expected, (missing, found)
    warming = [row for row in range(400) if "warming" in quality[row]]
    assert warming == list(range(109)) + list(range(331, 400)), warming
END

# A wrong file is one sentence.
wrong() { # TEXT CHANGE
  jq "$2" composite.json >wrong.json
  contains "$2" "$(/usr/bin/python3 -c 'import prism; prism.Model("wrong.json")' 2>&1 | tail -1)" "ValueError: wrong.json: $1"
}
wrong "found prism-model 4, expected prism-model 1 to 3" '.version = 4'
wrong "'beta' is missing" 'del(.beta)'
wrong "'variances' is missing" 'del(.variances)'
wrong "alpha: found a number that is not finite" '.alpha[0] = null'
wrong "kind: found forest" '.kind = "forest"'
wrong "features: found lagged inputs, which were removed: train again, with --response" '.features.lag_time_constants_s = [600]'
