# SPDX-License-Identifier: MIT
# A lot with missing and damaged recordings, results and models.
lot
sed 's/"70-1"/""/' g.json >none.json && prismd none.json --replay x.pcap --out rec/4/cycle1 >/dev/null 2>&1
mkdir -p rec/5/cycle1 rec/6/cycle1
for gyro in 1 2; do cp rec/$gyro/cycle1/*.csv rec/5/cycle1/$gyro.csv; done
rm -r rec/3/cycle2
cat >lot.json <<'J'
{"name": "lot", "recordings": [{"role": "train", "paths": "rec/*/cycle1"}, {"role": "repeat", "paths": "rec/*/cycle2"}],
 "models": {"line": {"method": "ls", "inputs": "T", "force": true},
 "short": {"method": "ls", "inputs": "T", "window": 300}}, "output": {"folder": "out", "reports": false}}
J
run() { echo "== $*" && prismcal campaign lot.json "$@" 2>&1 || echo "exit $?"; }
each() { while read -r task; do bash -c "$task" 2>&1 || echo "exit $?"; done; }
for action in --status --collect --task=0123 --plan; do run "$action"; done
run --engine print >tasks
sed -E 's|^.*/prismcal (.*) --task|prismcal \1 --task|' tasks
mv rec/2/cycle2 kept && cat tasks tasks | grep campaign | each
run --status
mv kept rec/2/cycle2 && grep campaign tasks | each
run --status
run --task ../x
run --collect
cat out/report/tables/models.csv
run --install models
for damage in 's/prism-manifest/x/' 's/"models"/"m"/' '1s/{/[/'; do
  cp models/manifest.json m.json && sed -i "$damage" models/manifest.json && run --install models
  cp m.json models/manifest.json
done
rm models/manifest.json && run --install models
cp m.json models/manifest.json && run --install models
model() { echo "$(dirname "$(grep -l '"model": "line"' $(grep -l '"serial": "'"$1"'"' out/tasks/*/result.json))")/model.json"; }
cp "$(model 70-1)" m.json && sed 's/"70-1"/"70-2"/' m.json >"$(model 70-1)" && run --install models
cp "$(model 70-2)" "$(model 70-1)" && run --install models
rm "$(model 70-1)" && run --install models
