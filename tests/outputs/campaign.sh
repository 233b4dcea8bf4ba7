# SPDX-License-Identifier: MIT
# A lot of three gyros with two models: plan, commands, status, report and accepted models.
for gyro in 1 2 3; do
  sed "s/70-1/70-$gyro/" g.json >g$gyro.json
  for part in 1 2; do
    capture x 4 $((gyro * 10 + part)) --profile fast
    prismd g$gyro.json --replay x.pcap --out rec/$gyro/cycle$part >/dev/null 2>&1
  done
done
cat >lot.json <<'J'
{"name": "lot", "recordings": [{"role": "train", "paths": "rec/*/cycle1"}, {"role": "repeat", "paths": "rec/*/cycle2"}],
 "models": {"line": {"method": "ls", "inputs": "T", "force": true}, "steps": {"method": "stepwise", "force": true}},
 "limits": {"repeat": {"improvement_percent": {"min": 30}, "bias_stability_deg_per_h": {"max": 0.02}}}, "output": {"folder": "out"}}
J
prismcal campaign lot.json --plan
prismcal campaign lot.json --engine print >tasks
wc -l <tasks
prismcal campaign lot.json --status
bash tasks >/dev/null 2>&1
prismcal campaign lot.json --status
prismcal campaign lot.json --collect || echo "exit $?"
show out/report/report.csv out/report/report.json | sed -E 's/(processor level[",: ]+)[-a-z0-9]+/\1LEVEL/'
prismcal campaign lot.json --install models && find models | sort
