# SPDX-License-Identifier: MIT
# A model as C: every model type compiles without a warning as C99, passes its self-test, and gives the biases of a replayed log
# from the log's one-second means.
. "$(dirname "$0")/lib.sh"
frames 2
echo '{"frames": "./frames.json", "clock": "device", "name": "g", "site": {"latitude_deg": 34.25, "elevation_deg": 90}, "correction": {"extrapolation": "flag"}}' >gyro.json
prismsim --profile paper --hours 7 --frames frames.json --seed 1 --out run.pcap 2>/dev/null
replay() { prismd gyro.json --replay run.pcap --model "$1" --out "$2" >replay.out 2>&1 || fail "the replay with $1: $(tail -1 replay.out)"; } # MODEL DIRECTORY
models=$PRISM_SOURCE/config/models
replay "$models/tao2019-model2.json" cycle
train() { prismcal train cycle --force --quiet --out "$@" >train.out 2>train.err || fail "training $1: $(tail -3 train.err)"; }
train lssvm.json --method lssvm --c 50 --sigma2 0.5
train ir-lssvm.json --method ir-lssvm --weight huber --c 50 --sigma2 0.5
train tuned.json --method ir-lssvm
train composite.json
train response.json --method stepwise --response 900

# Reads the means of one second a line, and prints the bias.
cat >feed.c <<'END'
#include <stdio.h>
#include "prism_predict.h"
static prism_state state;
int main(void) {
  long long second;
  double rate, temperature, uhfo;
  prism_reset(&state);
  while (scanf("%lld %lf %lf %lf", &second, &rate, &temperature, &uhfo) == 4) {
    const prism_second means = {second, (prism_number)rate, (prism_number)temperature, (prism_number)uhfo};
    printf("%.9f\n", (double)prism_push(&state, &means).bias_deg_per_h);
  }
  return 0;
}
END
compiled() { # COMPILER: warnings are errors; runs the self-test
  "$1" -std=c99 -Wall -Wextra -Werror -Wconversion -O1 -fsanitize=address,undefined -fno-sanitize-recover=all c/prism_predict.c c/prism_selftest.c -lm -o selftest 2>compile.err || fail "$1: $(head -3 compile.err)"
  ./selftest >selftest.out || fail "$1 $model: $(tail -3 selftest.out)"
}
exported() { # MODEL OPTIONS...
  rm -rf c
  prismcal export "$@" --c c >export.out 2>&1 || fail "export $1: $(cat export.out)"
  compiled gcc
  if command -v clang >/dev/null; then compiled clang; else echo "not tested: clang is not installed"; fi
}
for model in "$models"/tao2019-model{1,2}.json {lssvm,ir-lssvm,composite,response}.json; do
  exported "$model" --extrapolation clamp
  exported "$model" --float
  exported "$model"
  [ "$model" != composite.json ] || contains "the remark" "$(cat export.out)" 'Not exported: shrinking'
  gcc -std=c99 -O2 -Ic c/prism_predict.c feed.c -lm -o feed
  rm -rf served; replay "$model" served
  python3 - "$model" <<'END' || fail "$model: the C gives other biases than the log"
import csv, glob, math, subprocess, sys
lines = [line for name in sorted(glob.glob("served/*.csv")) for line in open(name) if not line.startswith("#")]
rows = [row for row in csv.DictReader(lines) if row["partial"] == "0"]
columns = "time_s", "rate_deg_per_h", "temperature_degc", "uhfo_v"
text = "".join(" ".join(row[name] or "nan" for name in columns) + "\n" for row in rows)
biases = [float(line) for line in subprocess.run("./feed", input=text, capture_output=True, text=True, check=True).stdout.split()]
assert len(biases) == len(rows) > 25000, (len(biases), len(rows))
worst = 0
for row, bias in zip(rows, biases):
    assert math.isnan(bias) == (row["bias_deg_per_h"] == ""), row
    if row["bias_deg_per_h"]: worst = max(worst, abs(bias - float(row["bias_deg_per_h"])))
print(f"{sys.argv[1]}: {len(rows)} seconds, largest difference {worst:.2e} deg/h")
assert worst < 1.5e-6, f"{worst:.2e} deg/h"
END
done

# Terms that cancel: the self-test allows for the rounding, and float is refused.
exported tuned.json
! prismcal export tuned.json --c c --float 2>float.err || fail "float was accepted"
contains "float" "$(cat float.err)" "its terms cancel; export it without --float"

# A wrong table is found.
exported lssvm.json
sed -i '/prism_weight/s/0x1\./0x1.f/' c/prism_model.h
gcc -std=c99 c/prism_predict.c c/prism_selftest.c -lm -o selftest
! ./selftest >selftest.out || fail "the self-test does not find a wrong weight"
! prismcal export lssvm.json --c c --extrapolation shrink 2>shrink.err || fail "shrinking was accepted"
