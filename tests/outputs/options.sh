# SPDX-License-Identifier: MIT
# The options of commands, one command a line of the page, on tables of 120 rows and fewer; the output in one line, and sums over the rows
# of the diagnostics of fit. A line that begins with $ makes the files of the lines below it.
awk 'BEGIN {print "i,x1,x2,y,fold,one"; for (i = 0; i < 120; ++i) {a = (i * 37 % 120) / 60 - 1; b = (i * 53 % 120) / 60 - 1
  printf "%d,%.5f,%.5f,%.6f,%d,1\n", i, a, b, sin(2 * a) + b * b + 0.01 * ((i * 7919) % 21 - 10) + (i % 40 == 7 ? 3 : 0), i % 5}}' >t.csv
for rows in 2 3 4 5 9 39 40; do head -$((rows + 1)) t.csv >t$rows.csv; done
sed -E '5s/,[^,]*/,/; 9s/(.*,.*,.*,).*(,.*,.*)/\1nan\2/' t.csv >holes.csv
awk -F, 'NR == 31 || NR == 92 {$4 = 900} {print $1 "," $2 "," $3 "," $4 "," $5}' t.csv >gross.csv
while read -r line; do
  [[ $line != "$ "* ]] || { eval "${line:2}" && continue; }
  echo "== $line" && true >d.csv
  [[ $line != fit* ]] || line+=" --diagnostics d.csv"
  # shellcheck disable=SC2086 # words
  prismcal $line 2>&1 || echo "exit $?"
  [[ $line != fit* ]] || awk -F, 'NR == 1 {print} {for (k = 1; k <= NF; ++k) sum[k] += $k * sqrt(NR)}
    END {for (k = 1; k <= NF; ++k) printf "%.6g%s", sum[k], (k < NF ? "," : "\n")}' d.csv
  [[ $line != *" p.csv"* ]] || cat p.csv
done <"$PAGE" |
  sed -E 's/(, )[0-9]+( evaluations)/\1N\2/; s/([0-9][.,][0-9]{4})[0-9]{7,}/\1/g' |  # the rest differs between levels of processors
  awk '/^== / {printf "%s%s\n", (NR > 1 ? "\n" : ""), $0; text = 0; next} {gsub(/  +/, " "); printf "%s%s", (text++ ? " | " : ""), $0} END {print ""}'
