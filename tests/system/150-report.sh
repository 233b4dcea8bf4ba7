# SPDX-License-Identifier: MIT
# The reports of prismcal evaluate and compare: three files without NaN, whose tables and figures end with their meaning, and which parse,
# whatever names the recordings have.
. "$(dirname "$0")/lib.sh"
frames 2
echo '{"frames": "./frames.json", "clock": "device", "name": "g", "site": {"latitude_deg": 34.25, "elevation_deg": 90}}' >gyro.json
for seed in 1 2; do
  prismsim --profile paper --hours 7 --frames frames.json --seed $seed --out $seed.pcap 2>/dev/null
  prismd gyro.json --replay $seed.pcap --model "$PRISM_SOURCE/config/models/tao2019-model2.json" --out cycle$seed >/dev/null
done

prismcal train cycle1 --method stepwise --quiet --out stepwise.json >train.out
prismcal train cycle1 --method ir-lssvm --weight huber --tune reml --quiet --out kernel.json >train.out
prismcal evaluate kernel.json cycle2 --out report >report.out 2>report.err || fail "$(tail -3 report.err)"
prismcal compare stepwise.json kernel.json --on cycle2 --out compared >compare.out 2>compare.err || fail "$(tail -3 compare.err)"
for folder in report compared; do
  for text in html csv json; do ! grep -iw nan $folder/report.$text || fail "NaN in $folder/report.$text"; done
done

# Each table and each figure ends with its meaning.
without_meaning() { jq -r '(.tables, .figures) | to_entries[] | select((.value.meaning // "") == "") | .key' "$1/report.json"; }
for folder in report compared; do same "tables and figures of $folder without a meaning" "$(without_meaning $folder)" ""; done
# Each chart is valid XML with allowed elements only, and HTML, JSON and CSV of the report parse.
parses() { # DIRECTORY
  python3 - "$1" <<'END' || fail "$1 does not parse"
import csv, glob, html.parser, json, re, sys
import xml.etree.ElementTree as xml
page = open(f"{sys.argv[1]}/report.html", encoding="utf-8").read()
drawings = [xml.fromstring(text) for text in re.findall(r"<svg.*?</svg>", page, re.S)]
assert drawings or sys.argv[1] == "compared"  # a comparison draws nothing
parts = [part for drawing in drawings for part in drawing.iter()]
assert {part.tag.split("}")[1] for part in parts} <= {"svg", "g", "path", "text", "title", "tspan", "clipPath"}
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
assert "<script" not in page
json.load(open(f"{sys.argv[1]}/report.json", encoding="utf-8"))
for table in glob.glob(f"{sys.argv[1]}/tables/*.csv"):
    for row in csv.reader(open(table, encoding="utf-8", newline="")):
        assert not any(re.match(r"[=@\t\r]|[+-](?![0-9.e+-]*$)", cell) for cell in row), row
END
}
parses report
parses compared

# The first page has what --test states, and empty fields; the last page has the files. Without Chromium --pdf fails.
echo '{"document": "TR-1 <b>", "customer": "C", "sensors": ["Pt100, calibrated 2026-05-02"]}' >test.json
prismcal evaluate kernel.json cycle2 --test test.json --quiet --out stated >/dev/null || fail "evaluate --test"
parses stated
contains "the first page" "$(cat stated/report.html)" "<dt>document</dt><dd>TR-1 &lt;b&gt;</dd>"
contains "an empty field" "$(cat stated/report.html)" "<dt>operator</dt><dd></dd>"
same "date of the evaluation" "$(jq -r .cover.evaluated stated/report.json)" "$(date -u +%F)"
contains "the files" "$(sed -n '/id="facts"/,$p' stated/report.html)" "$(sha256sum kernel.json | cut -c1-64)"
same "parameters that are not determined" "$(jq -r '[.tables.parameters.rows[] | select(.[2].text == "not determined") | .[0].text][0]' stated/report.json)" "turn-on to turn-on, 1 sigma"
prismcal allan cycle2 --test test.json --quiet --out noise >/dev/null || fail "allan --out"
parses noise
echo '{"client": "C"}' >bad.json
contains "an unknown key" "$(prismcal allan cycle2 --test bad.json --out noise 2>&1 >/dev/null || true)" "unknown key"
code=0; PATH=/nonexistent "$(command -v prismcal)" evaluate kernel.json cycle2 --quiet --pdf none.pdf >/dev/null 2>pdf.err || code=$?
same "exit code without Chromium" "$code" 1
contains "without Chromium" "$(cat pdf.err)" "found no Chromium"
if command -v chromium >/dev/null; then
  prismcal evaluate kernel.json cycle2 --quiet --pdf report.pdf --paper letter >/dev/null || fail "evaluate --pdf"
  same "the PDF" "$(head -c 5 report.pdf)" "%PDF-"
fi

# Names are never executed: an invalid axis name is rejected, a directory name or serial number with markup stays text.
command_name="x'; system \"touch pwned\"; set terminal svg name 'x"
markup='<img src=x onerror=alert(1)>'
mkdir named
awk -v axis="$command_name" '/^# axis: / {$0 = "# axis: " axis} {print}' cycle1/g-*.csv >named/g-20260101T000001Z.csv
code=0; prismcal evaluate kernel.json named --out hostile >hostile.out 2>hostile.err || code=$?
same "exit code for an axis name with a command" "$code" 1
contains "an axis name with a command" "$(tail -1 hostile.err)" "expected 1 to 16 letters, digits or _"
[ ! -e pwned ] && [ ! -e hostile ] || fail "a name in the header of a log was executed"
mkdir "=$markup"
awk -v serial="=$markup" '/^# gyro_serial: / {$0 = "# gyro_serial: " serial} {print}' cycle2/g-*.csv >"=$markup/g-20260101T000001Z.csv"
prismcal evaluate kernel.json "=$markup" --any-gyro --out hostile >hostile.out 2>hostile.err || fail "$(tail -3 hostile.err)"
[ ! -e pwned ] || fail "a name in the header of a log was executed"
parses hostile
same "tables and figures without a meaning" "$(without_meaning hostile)" ""
same "table files with unexpected names" "$(ls hostile/tables | grep -v '^[a-z0-9_]*\.csv$' || true)" ""
