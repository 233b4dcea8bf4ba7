# SPDX-License-Identifier: MIT
# prismcal report: Ctrl-C ends it with exit code 130 and a message, and leaves no incomplete report. Without Ctrl-C it writes
# three files with the model comparison and without NaN.
. "$(dirname "$0")/lib.sh"
PATH=$PRISM_BIN/tools/prismcal:$PATH
frames 2
cd "$dir"
echo '{"frames": "./frames.json", "clock": "device", "name": "g", "site": {"latitude_deg": 34.25, "elevation_deg": 90}}' >gyro.json
for seed in 1 2; do
  prismsim --profile paper --hours 12 --frames frames.json --seed $seed --out $seed.pcap 2>/dev/null
  prismd gyro.json --replay $seed.pcap --model "$PRISM_SOURCE/config/models/tao2019-model2.json" --out cycle$seed >/dev/null
done

# Background jobs of a shell script ignore SIGINT; env restores the default action.
start report env --default-signal=INT prismcal report cycle1 cycle2 --out report
wait_for 60 grep -q "ir-lssvm" report.err
kill -INT "$pid"
code=0; wait "$pid" || code=$?
same "exit code" "$code" 130
contains "stderr" "$(tail -1 report.err)" "prismcal: interrupted while training: no report was written"
[ ! -e report ] || fail "the interrupted command left $(ls report)"

prismcal report cycle1 cycle2 --models ladder --out report >ladder.out 2>ladder.err || fail "$(tail -3 ladder.err)"
for text in html csv json; do
  grep -q "IR-LSSVM, huber" report/report.$text || fail "report.$text has no IR-LSSVM"
  ! report_text report/report.$text | grep -iw nan || fail "NaN in report.$text"
done
same "rows of the model comparison" "$(jq -r '.tables.ladder.rows[][0].text' report/report.json | paste -sd/)" \
  "LS, cubic/stepwise, model 1/stepwise, model 2/LSSVM/IR-LSSVM, huber"
# Each improvement has an interval, and each row states whether the model is better or worse, or cannot be distinguished.
jq -e '.tables.ladder.rows[] | .[6].text | test("^-?[0-9.]+ to -?[0-9.]+$")' report/report.json >/dev/null || fail "the model comparison has no intervals"
jq -e '.tables.ladder.rows[1:][] | .[-1].text | test(": (not distinguishable|better|worse)$")' report/report.json >/dev/null ||
  fail "the model comparison does not state which rows differ"

# Each table and each figure ends with its meaning.
same "tables and figures without a meaning" "$(jq -r '(.tables, .figures) | to_entries[] | select((.value.meaning // "") == "") | .key' report/report.json)" ""
# Each chart is valid XML with allowed elements only, and HTML, JSON and CSV of the report parse.
parses() { # DIRECTORY
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

# Names are never executed: an invalid axis name is rejected, a directory name or serial number with markup stays text.
command_name="x'; system \"touch pwned\"; set terminal svg name 'x"
markup='<img src=x onerror=alert(1)>'
mkdir named
awk -v axis="$command_name" '/^# axis: / {$0 = "# axis: " axis} {print}' cycle1/g-*.csv >named/g-20260101T000001Z.csv
code=0; prismcal report named cycle2 --models ladder --out hostile >hostile.out 2>hostile.err || code=$?
same "exit code for an axis name with a command" "$code" 1
contains "an axis name with a command" "$(tail -1 hostile.err)" "expected 1 to 16 letters, digits or _"
[ ! -e pwned ] && [ ! -e hostile ] || fail "a name in the header of a log was executed"
for cycle in 1 2; do
  mkdir "=$markup$cycle"
  for axis in x y; do
    awk -v axis="$axis" -v serial="=$markup" '/^# axis: / {$0 = "# axis: " axis} /^# gyro_serial: / {$0 = "# gyro_serial: " serial} {print}' cycle$cycle/g-*.csv \
      >"=$markup$cycle/g-$axis-20260101T000001Z.csv"
  done
done
prismcal report "=${markup}1" "=${markup}2" --models ladder --out hostile >hostile.out 2>hostile.err || fail "$(tail -3 hostile.err)"
[ ! -e pwned ] || fail "a name in the header of a log was executed"
parses hostile
same "tables and figures without a meaning" "$(jq -r '(.tables, .figures) | to_entries[] | select((.value.meaning // "") == "") | .key' hostile/report.json)" ""
same "table files with unexpected names" "$(ls hostile/tables | grep -v '^[a-z0-9_]*\.csv$' || true)" ""
