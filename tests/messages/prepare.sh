#!/bin/bash
# SPDX-License-Identifier: MIT
# Makes the inputs of the cases in the current directory.
set -euo pipefail
models=$SOURCE/config/models
cat >good.json <<END
{"name": "gyro1", "gyro": {"serial": "70-0001"}, "line": {"device": "/dev/null"}, "frames": "trplg", "clock": "host", "log": {"directory": "logs"}}
END
cat >live.json <<END
{"line": {"device": "tty"}, "write_log": false}
END
cp "$models/tao2019-model2.json" model.json
cp "$SOURCE/config/frames/trplg.json" frames.json
prismsim --hours 0.2 --rate 10 --frames trplg --out gyro.pcap --truth truth.csv 2>/dev/null
head -c 1000 gyro.pcap >half.pcap
printf 'not a capture' >text.pcap
sed 's/"rate_hz": 200/"rate_hz": 10/' frames.json >slow.json
sed -i 's|"\$schema": "frame.schema.json",||' slow.json
cat >replay.json <<END
{"name": "gyro1", "gyro": {"serial": "70-0001"}, "frames": "./slow.json", "clock": "device", "log": {"directory": "logs"}}
END
prismd --replay gyro.pcap --out log replay.json 2>/dev/null >/dev/null
segment=$(find log -name '*.csv' | head -1)
cp "$segment" segment.csv
sed 's/^# prism-log 2/# prism-log 9/' segment.csv >newer.csv
sed '20s/[0-9]/x/3' segment.csv >damaged.csv
python3 - <<'END'
import math
with open("table.csv", "w") as file:
    file.write("t,T,U,y\n")
    for i in range(120):
        file.write(f"{i * 100},{20 + 10 * math.sin(i / 9):.4f},{5 + 0.01 * (i % 7)},{0.5 * math.sin(i / 9) + 0.001 * (i % 5):.5f}\n")
    # the other tables have one error each
with open("table.csv") as file:
    lines = file.read().split("\n")
def write(name, changed):
    with open(name, "w") as file:
        file.write("\n".join(changed))
write("short.csv", lines[:4] + [""])
write("empty.csv", [])
write("units.csv", ["t,T,U,y [deg/h]"] + lines[1:])
write("names.csv", lines[:1] + [""])
write("text.csv", lines[:10] + ["900,warm,5,0.1"] + lines[11:])
write("missing.csv", lines[:10] + ["900,21.5"] + lines[11:])
write("constant.csv", [lines[0]] + [line.rsplit(",", 1)[0] + ",1" for line in lines[1:-1]] + [""])
write("twice.csv", ["t,T,T,y"] + lines[1:])
END
mkdir -p empty data
cp table.csv data/
prismcal fit table.csv --inputs T,U --target y --method lssvm --c 10 --sigma2 1 --out kernel.json --quiet >/dev/null
