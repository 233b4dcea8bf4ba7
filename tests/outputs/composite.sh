# SPDX-License-Identifier: MIT
# The default method: its summary, its prediction inside and outside its range, the next recording that it asks for.
log a 6 1 --profile fast
log b 4 2 --profile beyond --outliers 0.5
prismcal train a --out m.json --force --quiet
prismcal evaluate m.json b --quiet
prismcal evaluate m.json b --extrapolation flag --quiet >flagged && head -12 flagged
awk 'BEGIN {print "T,dTdt,U"; for (i = 0; i < 24; ++i) printf "%.2f,%.5f,%.4f\n", -60 + 6 * i, (i % 5 - 2) / 100, 5 + (i % 3) / 100}' >t.csv
prismcal predict m.json t.csv --out p.csv
show p.csv
prismcal design m.json --domain "T=-30:50, dTdt=-0.5:0.5 degC/min" --hours 4 --out cycle.csv
show cycle.csv
