# SPDX-License-Identifier: MIT
# A report of two recordings: text, JSON and page.
log a 4 3 --profile fast
log b 5 4 --profile fast --outliers 1 --lose-frames 0.001 --hysteresis 0.01
prismcal train a --method stepwise --out m.json --force --quiet >/dev/null
prismcal evaluate m.json b --out report --simulated
show report/report.json report/report.html
prismcal evaluate m.json a b --in-sample --divisor N --extrapolation clamp --max-bias 0.01 || echo "exit $?"
# Long recordings are reduced; the number of samples per second is their median.
prismcal train a --method ls --inputs T --window 10 --end-mean 5 --out short.json --force --quiet >/dev/null
for all in "" --all-blocks; do prismcal evaluate short.json b --json --quiet $all 2>/dev/null | grep -c 'all: --all-blocks' || true; done
mkdir mixed && awk -F, -v OFS=, '/^[0-9]/ {$3 = 9 + (NR % 5 > 1) + (NR % 5 > 3)} {print}' b/*.csv >mixed/b.csv
prismcal evaluate m.json mixed --quiet | grep -A2 'samples  '
