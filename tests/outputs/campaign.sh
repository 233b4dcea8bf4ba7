# SPDX-License-Identifier: MIT
# A lot of three gyros with two models: plan, commands, status, report and accepted models.
lot
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
