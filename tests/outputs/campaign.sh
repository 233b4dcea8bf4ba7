# SPDX-License-Identifier: MIT
# A lot of three gyros with two models: plan, commands, status, report and accepted models. A lot of tables, with two repeats; a removed
# option of a model.
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
show out/report/report.json | sed -E 's/(processor level[",: ]+)[-a-z0-9]+/\1LEVEL/'
prismcal campaign lot.json --install models && find models | sort
mkdir tab
for gyro in 1 2; do
  grep -hv '^#' rec/$gyro/cycle1/*.csv >tab/S$gyro-1.csv
  grep -hv '^#' rec/$gyro/cycle2/*.csv >tab/S$gyro-2.csv
  grep -hv '^#' rec/3/cycle$gyro/*.csv >tab/S$gyro-3.csv
done
cat >tables.json <<'J'
{"recordings": [{"role": "train", "paths": "tab/*-1.csv", "serial": "*"},
                {"role": "repeat", "paths": ["tab/*-2.csv", "tab/*-3.csv"], "serial": "*"}],
 "reading": {"map": ["rate=rate_deg_per_h:deg/h", "temperature=temperature_degc:degC", "time=time_utc"], "no-earth-rate": true},
 "models": {"line": {"method": "ls", "inputs": "T", "force": true}}, "output": {"reports": false}}
J
prismcal campaign tables.json --engine print | bash
prismcal campaign tables.json --collect
cat tables.campaign/report/tables/gyros.csv
sed 's/"map"/"separator": ";", "map"/' tables.json >removed.json
prismcal campaign removed.json --plan || echo "exit $?"
