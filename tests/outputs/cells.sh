# SPDX-License-Identifier: MIT
# Tables as inspect reads them: each line of the page is a table, or the cells of a column of times with | between them; then, after a tab,
# options. One line of output each.
while IFS=$'\t' read -r table options; do
  echo "== $table${options:+ $options}"
  [[ $table != *\\n* && $table == *"|"* ]] && table="time,rate (deg/h)\n${table//|/,1.5\\n},1.5"
  printf '%b\n' "$table" >x.csv
  # shellcheck disable=SC2086 # words
  prismcal inspect x.csv $options 2>&1 || echo "exit $?"
done <"$PAGE" |
  awk '/^== / {if (NR > 1) print ""; print; text = ended = 0; next} ended || /^(column |DEG|prismcal (train|fit)|No column|These|Replace|$)/ {next}
    {gsub(/  +/, " "); printf "%s%s", text ? " | " : "", $0; text = 1; ended = /^prismcal: /} END {print ""}'
