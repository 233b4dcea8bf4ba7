# SPDX-License-Identifier: MIT
# prismcal report: Ctrl-C ends it soon with 130, says so in one line and leaves no half report; left alone it writes its
# three files, with the ladder in them and without a NaN.
. "$(dirname "$0")/lib.sh"
PATH=$PRISM_BIN/tools/prismcal:$PATH
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

# Every drawing is XML of its own elements, and every form of the report parses.
parses() { # FOLDER
  python3 - "$1" <<'END' || fail "$1 does not parse"
import csv, html.parser, json, re, sys
import xml.etree.ElementTree as xml
page = open(f"{sys.argv[1]}/report.html", encoding="utf-8").read()
drawings = [xml.fromstring(text) for text in re.findall(r"<svg.*?</svg>", page, re.S)]
assert len(drawings) > 5, len(drawings)
parts = [part for drawing in drawings for part in drawing.iter()]
assert {part.tag.split("}")[1] for part in parts} <= {"svg", "g", "path", "text", "tspan", "clipPath"}
ids = [part.get("id") for part in parts if part.get("id")]
assert len(ids) == len(set(ids)) and all(re.fullmatch(r"plot\d+-\d+", one) for one in ids), ids
assert not any(name.startswith("on") for part in parts for name in part.attrib)
class Reader(html.parser.HTMLParser):
    def handle_starttag(self, tag, attributes):
        assert tag not in ("img", "iframe", "object", "i"), tag
        for name, value in attributes:
            assert not name.startswith("on"), name
            assert name not in ("id", "href") or re.fullmatch(r"[#a-z0-9_-]+", value), value
Reader().feed(page)
for data in re.findall(r'<script type="application/json">(.*?)</script>', page, re.S):
    json.loads(data)
json.load(open(f"{sys.argv[1]}/report.json", encoding="utf-8"))
for row in csv.reader(open(f"{sys.argv[1]}/report.csv", encoding="utf-8", newline="")):
    assert not any(re.match(r"[=@\t\r]|[+-](?![0-9.e+-]*$)", cell) for cell in row), row
END
}
parses report

# Names of strangers are text: of the recordings, and of two axes in the headers of their logs.
command_name="x'; system \"touch pwned\"; set terminal svg name 'x"
markup='<img src=x onerror=alert(1)>'
# The name of an axis is rejected with its line; a serial number with markup is text.
mkdir named
awk -v axis="$command_name" '/^# axis: / {$0 = "# axis: " axis} {print}' cycle1/g-*.csv >named/g-20260101T000001Z.csv
code=0; prismcal report named cycle2 --models ladder --out hostile >hostile.out 2>hostile.err || code=$?
same "exit code of an axis with a command" "$code" 1
contains "an axis with a command" "$(tail -1 hostile.err)" "expected 1 to 16 letters, digits or _"
[ ! -e pwned ] && [ ! -e hostile ] || fail "a name in the header of a log ran a command"
for cycle in 1 2; do
  mkdir "=$markup$cycle"
  for axis in x y; do
    awk -v axis="$axis" -v serial="=$markup" '/^# axis: / {$0 = "# axis: " axis} /^# gyro_serial: / {$0 = "# gyro_serial: " serial} {print}' cycle$cycle/g-*.csv \
      >"=$markup$cycle/g-$axis-20260101T000001Z.csv"
  done
done
prismcal report "=${markup}1" "=${markup}2" --models ladder --out hostile >hostile.out 2>hostile.err || fail "$(tail -3 hostile.err)"
[ ! -e pwned ] || fail "a name in the header of a log ran a command"
parses hostile
same "files of tables" "$(ls hostile/tables | grep -v '^[a-z0-9_]*\.csv$' || true)" ""
