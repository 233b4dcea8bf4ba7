# SPDX-License-Identifier: MIT
# Coefficients and the deviation of a log, of a table with missing rows, and of a short one.
log a 12 8 --flicker 0.004
prismcal allan a
summary() {  # jq 1.7 keeps the digits of a number with which it does not calculate
  jq -c '.warning, .facts, (.tables[].rows[] | map(.value // .text | if type == "number" then . + 0 else . end))'
}
prismcal allan a --json | summary
awk 'BEGIN {srand(1); print "time_s,rate_dps"; for (i = 0; i < 3000; ++i) if (i < 900 || i > 1100) printf "%.2f,%.6f\n", i / 50, 0.004 + 0.0001 * ((i * 7919) % 101 - 50) / 50}' >t.csv
prismcal allan t.csv --column rate_dps --unit deg/s
prismcal allan t.csv --column rate_dps --unit deg/s --json | summary
head -60 t.csv >short.csv
prismcal allan short.csv --column rate_dps --unit deg/s
for rows in 7 8 9 31 32 33 64 65 150 600; do
  head -$((rows + 1)) t.csv | awk -F, 'NR == 1 {print $2} NR > 1 {print (NR == 40 || NR == 100 ? "nan" : $2 + NR / 300000)}' OFMT=%.8g >r.csv
  prismcal allan r.csv --column rate_dps --unit deg/s --interval 0.5 --quiet || echo "exit $?"
done
