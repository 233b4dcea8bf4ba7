# SPDX-License-Identifier: MIT
# Whether a model still holds, of a quiet log, an aged gyro and a short log; and its constant from a new recording.
log a 26 1 --profile paper
monitor() { echo "== $*"; prismcal monitor "$@" 2>&1 || echo "exit $?"; }
made() { echo "== $*"; prismcal train "$@" --quiet 2>&1 | sed -E 's|([0-9][.][0-9]{6})[0-9]+|\1|' || true; }
prismcal train a --out m.json --quiet >made
monitor m.json a
sed -E 's/("delay_h": *)[0-9.]+/\112/' m.json >sure.json
monitor sure.json a
log aged 52 2 --profile paper --ageing 0.01 --age 30
monitor m.json aged
python3 -c 'import json; m = json.load(open("m.json")); del m["monitor"]; json.dump(m, open("old.json", "w"))'
monitor old.json a
monitor old.json a --training a --out new.json
log short 0.5 3 --profile fast
monitor old.json a --training short
monitor old.json short --any-gyro --training a --leave-out 90000..92000 # in one of the two
monitor m.json short
monitor m.json short --any-gyro --leave-out 0..100000
monitor --instance none.json
awk 'BEGIN {print "T,y"; for (i = 0; i < 60; ++i) print i % 17 "," i % 17 + i * 7 % 5 / 10}' >t.csv
prismcal fit t.csv --target y --inputs T --method ls --out table.json --quiet >>made
jq -s '.[0] + {monitor: .[1].monitor}' table.json m.json >with.json
monitor with.json a
log moved 3 2 --profile steady --turn-on 0.1
log same 3 2 --profile steady
made --from m.json same --out x.json
made --from m.json moved --out x.json
made --from m.json same --out x.json --force
made --from m.json moved --out x.json --json
made --from m.json moved same --out x.json
made --from m.json short --out y.json
for method in ls stepwise; do
  prismcal train a --method $method --inputs T --out $method.json --quiet --force >>made
  made --from $method.json moved --out y.json --json
  monitor y.json moved
done
