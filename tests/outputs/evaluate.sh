# SPDX-License-Identifier: MIT
# A report of two recordings: text, JSON and page.
log a 4 3 --profile fast
log b 5 4 --profile fast --outliers 1 --lose-frames 0.001 --hysteresis 0.01
prismcal train a --method stepwise --out m.json --force --quiet >/dev/null
prismcal evaluate m.json b --out report --simulated
show report/report.json report/report.html
prismcal evaluate m.json a b --in-sample --divisor N --extrapolation clamp --max-bias 0.01 || echo "exit $?"
