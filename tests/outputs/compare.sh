# SPDX-License-Identifier: MIT
# Three models on two recordings.
log a 4 5 --profile fast
log b 4 6 --profile second
prismcal train a --method ls --inputs T --out ls.json --force --quiet >/dev/null
prismcal train a --method stepwise --out stepwise.json --force --quiet >/dev/null
prismcal train a --method lssvm --c 10 --sigma2 2 --out lssvm.json --force --quiet >/dev/null
prismcal compare ls.json stepwise.json lssvm.json "$SOURCE/config/models/tao2019-model2.json" --any-gyro --on b --on a --out report
show report/report.json report/tables/*.csv
# Names longer than their columns.
for name in a-second-cycle-of-one-gyro-70 a-second-cycle-of-one-gyro-7; do cp -r b $name; done
prismcal compare ls.json stepwise.json --on a-second-cycle-of-one-gyro-70 --on a-second-cycle-of-one-gyro-7
