# SPDX-License-Identifier: MIT
# Training with what other recordings and gyros tell: models of siblings, and two recordings that warm up.
train() { echo "== $*"; prismcal train "$@" --out m.json --force --quiet | sed -E "s|, [0-9]+ evaluations||"; python3 -c 'import json; m = json.load(open("m.json")); del m["id"], m["provenance"]["made"]; print(json.dumps(m, separators=(",", ":")))' | sed -E 's|([0-9][.][0-9]{6})[0-9]+|\1|g'; }
mkdir models
for i in 1 2; do
  sed -i "s/70-[0-9]/70-$i/" g.json
  log s$i 3 $i --profile fast --turn-on 0.1
  prismcal train s$i --out models/s$i.json --force --quiet >made 2>&1 || cat made
done
sed -i "s/70-[0-9]/70-7/" g.json
log own 2 7 --profile fast
train own --prior models
awk 'BEGIN {print "T,dTdt,U"; for (i = 0; i < 12; ++i) printf "%.2f,%.5f,%.4f\n", -60 + 12 * i, (i % 5 - 2) / 100, 5 + (i % 3) / 100}' >t.csv
prismcal predict m.json t.csv --out p.csv
show p.csv
prismcal export m.json --c c || echo "exit $?"
log w1 9 4 --warm-up 0.2
log w2 9 5 --warm-up 0.2
train w1 w2 --inputs T,dTdt
