# SPDX-License-Identifier: MIT
# A table of another program: refused, made a plain one, how that is understood, its model and its evaluation.
awk 'BEGIN {print "Zeit;Rate (°/h);Gehäuse (°C);U (V)"; for (i = 0; i < 30000; ++i) { t = 20 + 25 * sin(i / 4000); r = 7.4 + 0.01 * t + 0.002 * ((i * 7919) % 211 - 105) / 100;
  if (i == 7000) r = 900; if (i > 21000 && i < 21400) continue; if (i > 15000 && i < 15100) r = ""
  row = sprintf("%02d.%02d.2026 %02d:%02d:%02d;%s;%s;%s", 3 + int(i / 86400), 5, int(i / 3600) % 24, int(i / 60) % 60, i % 60, r == "" ? "" : sprintf("%.4f", r), sprintf("%.3f", t), sprintf("%.3f", 5 + t / 1000)); gsub(/\./, ",", row)
  sub(/,/, ".", row); sub(/,/, ".", row); print row } }' >t.csv
prismcal inspect t.csv || echo "exit $?"
"$SOURCE/tools/prism-import/prism_import.py" t.csv --out plain.csv || echo "exit $?"
"$SOURCE/tools/prism-import/prism_import.py" t.csv --time Zeit:dmy --out plain.csv
head -3 plain.csv
map=(--map "rate=2:deg/h,temperature=3:degC,uhfo=4:V,time=1" --no-earth-rate)
prismcal inspect plain.csv
prismcal inspect plain.csv --json
prismcal train plain.csv "${map[@]}" --method stepwise --inputs T --out m.json
prismcal evaluate m.json plain.csv "${map[@]}" --in-sample
prismcal convert plain.csv "${map[@]}" --out t.pcap
sed 's/"rate_hz": 200/"rate_hz": 1/; /"valid": {/d' "$SOURCE/config/frames/trplg.json" >one.json  # its frames cannot mark an unknown rate
prismcal convert plain.csv "${map[@]}" --frames ./one.json --out one.pcap
prismcal inspect t.pcap || echo "exit $?"
for form in v6 v7; do prismcal inspect "$SOURCE/tests/files/octave/octave-$form.mat" || echo "exit $?"; done
