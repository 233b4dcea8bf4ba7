# SPDX-License-Identifier: MIT
# Models of a table of plain numbers: fit, cross-validation, prediction.
awk 'BEGIN {print "x1,x2,y,fold"; for (i = 0; i < 120; ++i) {a = (i * 37 % 120) / 60 - 1; b = (i * 53 % 120) / 60 - 1; printf "%.5f,%.5f,%.6f,%d\n", a, b, sin(2 * a) + b * b + 0.01 * ((i * 7919) % 21 - 10), i % 5}}' >t.csv
fit() {
  echo "== $*"
  prismcal fit t.csv --target y --out m.json --diagnostics d.csv --quiet --method "$@"
  prismcal predict m.json t.csv --out p.csv
  head -8 p.csv d.csv
}
fit ls --inputs x1
fit stepwise --inputs x1,x2
fit lssvm --inputs x1,x2 --c 50 --sigma2 0.8
fit ir-lssvm --inputs x1,x2 --c 50 --sigma2 0.8 --weight logistic
fit svr --inputs x1,x2 --c 10 --sigma2 1 --epsilon 0.05
for weight in huber hampel logistic myriad; do prismcal cv t.csv --inputs x1,x2 --target y --c 10 --sigma2 0.5 --weight $weight --folds 5; done
prismcal cv t.csv --inputs x1,x2 --target y --c 10 --sigma2 0.5 --fold-column fold --json
awk -F, -v OFS=, '{print $1, NR == 1 ? "two" : NR % 2 * 3 + 1, $3}' t.csv >u.csv
for method in "lssvm --c 50 --sigma2 0.8" "svr --c 10 --sigma2 1 --epsilon 0.05"; do
  echo "== $method, an input of two values"
  prismcal fit u.csv --target y --out m.json --inputs x1,two --quiet --method $method
  prismcal predict m.json u.csv --out p.csv
  head -8 p.csv
done
prismcal fit u.csv --target y --out m.json --inputs two --method ls || echo "exit $?"
prismcal fit --help | grep -e '--method TEXT'
