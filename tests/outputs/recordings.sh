# SPDX-License-Identifier: MIT
# A recording of 4000 s with a fault (first part of each line of the page: statements of awk) or options (second): what train, or the
# command before the options, reports about its times, values and blocks; without the lines that the first one has too.
while IFS=$'\t' read -r change options; do
  echo "== $change${options:+ $options}"
  awk -v OFS=, -v OFMT=%.7g "BEGIN {print \"t (s),rate (deg/h),T (degC),U (V)\"; for (i = 0; i < 4000; ++i) {t = i; T = 20 + 15 * sin(i / 500)
    U = 5 + T / 1000; r = 7.4 + 0.01 * T + 0.002 * ((i * 7919) % 211 - 105) / 100; skip = 0; $change; if (!skip) print t, r, T, U}}" >x.csv
  [[ $options == [a-z]* || $options == *--inputs* ]] || options+=" --inputs T --method ls"
  [[ $options == [a-z]* || $options == *--map* ]] || options="--map rate=2,temperature=3,uhfo=4,time=1 $options"
  [[ $options == [a-z]* ]] || options="train --no-earth-rate --accept-unit --window 25 --end-mean 5 --force --out m $options"
  # shellcheck disable=SC2086 # words
  prismcal ${options%% *} x.csv ${options#* } 2>&1 || echo "exit $?"
done <"$PAGE" |
  sed -E '/^(Data|question|Checked|the recordings name|  (model|coef|cond)|$)/d; s/^x.csv: UTF-8.*; ([0-9]+ rows)/\1/; s/  +/ /g' |
  awk '/^==/ {++cases; if (row) print row; row = ""} cases == 1 {usual[$0]} cases > 1 && $0 in usual {next}
    /^ (intercept|T|dTdt|U|residual)/ {row = row $0 ";"; next} {print row $0; row = ""}'
