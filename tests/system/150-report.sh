# SPDX-License-Identifier: MIT
# prismcal report: Ctrl-C ends it soon with 130, says so in one line and leaves no half report; left alone it writes its
# three files, with the ladder in them and without a NaN.
. "$(dirname "$0")/lib.sh"
PATH=$PRISM_BIN/tools/prismcal:$PATH
command -v gnuplot >/dev/null || skip "no gnuplot"
frames 2
cd "$dir"
echo '{"frames": "./frames.json", "clock": "device", "name": "g", "site": {"latitude_deg": 34.25, "elevation_deg": 90}}' >gyro.json
for seed in 1 2; do
  prismsim --profile paper --hours 12 --frames frames.json --seed $seed --out $seed.pcap 2>/dev/null
  prismd gyro.json --replay $seed.pcap --model "$PRISM_SOURCE/config/models/tao2019-model2.json" --out cycle$seed >/dev/null
done

# A shell script's background jobs ignore SIGINT: env gives the signal its meaning back.
start report env --default-signal=INT prismcal report cycle1 cycle2 --out report
wait_for 60 grep -q "ir-lssvm" report.err
kill -INT "$pid"
code=0; wait "$pid" || code=$?
same "exit code" "$code" 130
contains "stderr" "$(tail -1 report.err)" "prismcal: interrupted while training: no report was written"
[ ! -e report ] || fail "left $(ls report)"

prismcal report cycle1 cycle2 --models ladder --out report >ladder.out 2>ladder.err || fail "$(tail -3 ladder.err)"
for text in html csv json; do
  grep -q "IR-LSSVM, huber" report/report.$text || fail "report.$text has no IR-LSSVM"
  ! report_text report/report.$text | grep -iw nan || fail "NaN in report.$text"
done
same "rows of the ladder" "$(jq -r '.tables.ladder.rows[][0].text' report/report.json | paste -sd/)" \
  "LS, cubic/stepwise, model 1/stepwise, model 2/LSSVM/IR-LSSVM, huber"
# Every improvement with its interval, and rows of the ladder that may be one number said to be that.
jq -e '.tables.ladder.rows[] | .[6].text | test("^-?[0-9.]+ to -?[0-9.]+$")' report/report.json >/dev/null || fail "the ladder has no intervals"
jq -e '.tables.ladder.rows[1:][] | .[-1].text | test(": (not distinguishable|better|worse)$")' report/report.json >/dev/null ||
  fail "the ladder does not say which rows differ"
