# SPDX-License-Identifier: MIT
# Each policy of an output while the window fills and while the thermometer is lost (implausible above 28 degC): a replay's frames.
. "$(dirname "$0")/lib.sh"
prismsim --rate 2 --profile fast --seed 3 --hours 3 --out run.pcap 2>/dev/null
sent() { # NAME MEMBERS: the bytes of an output with these members, in NAME.bin
  cat >gyro.json <<END
{"name": "g", "frames": "trplg", "rate_hz": 2, "clock": "device", "accept_clock": true, "site": {"latitude_deg": 34.25, "elevation_deg": 90},
 "model": "$PRISM_SOURCE/config/models/tao2019-model2.json", "plausibility": {"temperature": {"range_degc": [-60, 28]}},
 "out": [{"line": {"udp": {"address": "127.0.0.1:9"}}, $2}]}
END
  rm -rf log; prismd gyro.json --replay run.pcap --out log --out-frames "$1.bin" >/dev/null 2>replay.err || fail "$1: $(tail -1 replay.err)"
  [ "$3" = other ] || python3 "$PRISM_SOURCE/tests/system/out_reader.py" messages "$1.bin" >"$1.txt"
}
sent raw '"frames": "prism", "when_unknown": "raw"' prism
sent drop '"frames": "prism", "when_unknown": "drop"' prism
sent hold-drop '"frames": "prism", "when_unknown": "hold", "hold_s": 60, "then": "drop"' prism
sent hold-raw '"frames": "prism", "when_unknown": "hold", "hold_s": 60, "then": "raw"' prism
sent dmu11 '"frames": "dmu11", "when_unknown": "drop"' other
log_text log/*.csv >log.csv
python3 - <<'END' || fail "the policies"
import csv, struct
from math import ceil
FADING, HELD, RAW, FADE = 1 << 16, 1 << 17, 1 << 18, 0.001
def rows(name):
    """time → rate, correction, flags"""
    lines = [[float(word) for word in line.split()] for line in open(f"{name}.txt")]
    return {time: (rate, correction, int(flags)) for _, _, time, rate, correction, _, flags in lines}
raw, drop, hold_drop, hold_raw = rows("raw"), rows("drop"), rows("hold-drop"), rows("hold-raw")
log = list(csv.DictReader(line for line in open("log.csv") if not line.startswith("#")))
lost = {row["quality"] for row in log if row["bias_deg_per_h"] == ""}
assert any("implausible" in each for each in lost) and any(each == "warming" for each in lost), lost
# The engine has a correction in the second after a window with a bias.
biases = {int(row["time_s"]) + 1: float(row["bias_deg_per_h"]) for row in log if row["bias_deg_per_h"]}
assert {time for time in raw if ceil(time) in biases} == set(drop), "drop: other frames than those with a correction"
assert 5000 < len(drop) < len(raw) - 4000, (len(drop), len(raw))
for time, (_, correction, flags) in drop.items():
    assert flags & (RAW | HELD) == 0 and (flags or abs(correction - biases[ceil(time)]) < 1e-6), (time, correction, flags)
last = before = None
for time in sorted(raw):
    _, correction, flags = raw[time]
    kind = flags & (RAW | HELD | FADING)
    assert kind in ((0, FADING) if time in drop else (RAW, FADING)), (time, flags)
    assert kind != RAW or correction == 0, (time, correction)
    if kind == FADING:
        assert before is None or abs(correction - before) <= FADE * 0.5 + 1e-12, f"a step of {correction - before} at {time}"
    before = correction
    if time in drop:
        last = time, hold_drop[time][1]
        assert hold_drop[time][2] & (RAW | HELD) == 0
        continue
    held = last is not None and time - last[0] <= 60
    assert held == (time in hold_drop), time
    assert bool(hold_raw[time][2] & HELD) == held or hold_raw[time][2] & FADING, (time, hold_raw[time])
    if held and not hold_drop[time][2] & FADING:
        assert hold_drop[time][1] == last[1] and hold_drop[time][2] & HELD, (time, hold_drop[time])
assert any(flags & HELD for _, _, flags in hold_drop.values()) and any(flags & RAW for _, _, flags in hold_raw.values())
# Another device's frames have the corrected rate.
data = open("dmu11.bin", "rb").read()
assert len(data) == 40 * len(drop), (len(data), len(drop))
for at, time in zip(range(0, len(data), 40), sorted(drop)):
    rate, correction, _ = drop[time]
    found = struct.unpack(">f", data[at + 4:at + 8])[0] * 3600
    assert data[at:at + 2] == b"\x55\xaa" and abs(found - (rate - correction)) < 1e-5, (time, found, rate - correction)
END
