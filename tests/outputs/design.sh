# SPDX-License-Identifier: MIT
# The first recording of a gyro.
prismcal design --bias-sd 0.01 --noise 0.003 --domain "T=0:40, dTdt=-1:1 degC/min" --chamber "rate<=2 degC/min, T=-10:50" --hours 3 --out first.csv --report plan
show first.csv plan/report.csv plan/report.json
prismcal design --bias-sd 0.01 --noise 0.003 --domain "T=-20:40, U=4:6" --hours 2 --start 10 --thermal-lag 20 --self-heating 1 --out second.csv --json --quiet
