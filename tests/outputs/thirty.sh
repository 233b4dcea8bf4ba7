# SPDX-License-Identifier: MIT
# Thirty recordings, half of them bad, in three commands: which are good, which method, and its model.
python3 "$SOURCE/tests/outputs/thirty.py"
how=(--map rate=2:deg/h,temperature=3:degC,uhfo=4:V,time=1:s --latitude 34.25 --elevation 90 --max-gap 10 --end-mean 10)
prismcal inspect day*.csv --latitude 34.25 --elevation 90 --max-gap 10 --end-mean 10
prismcal inspect day01.csv day05.csv || echo "exit $?"
prismcal inspect day03.csv day05.csv day11.csv day30.csv --latitude 34.25 --elevation 90 --max-gap 10 --end-mean 10 --json
prismcal compare composite stepwise --leave-one-out --on day0[1-9].csv day14.csv "${how[@]}" --quiet --out report
grep '"left out"' report/report.json
show report/tables/comparison.csv
prismcal train day0[1-6].csv "${how[@]}" --method stepwise --out model.json 2>&1 | grep -v ^day
prismcal compare model.json --on day1*.csv "${how[@]}"
prismcal train day01.csv day03.csv "${how[@]}" --out strict.json --strict --quiet || echo "exit $?"
prismcal train day03.csv "${how[@]}" --out spikes.json --quiet 2>&1 | grep prismcal: || true
prismcal compare stepwise --leave-one-out --on day01.csv day03.csv "${how[@]}" || echo "exit $?"
prismcal compare stepwise --leave-one-out --inputs T,dTdt,box.volt --on day01.csv day02.csv day04.csv "${how[@]/uhfo/box.volt}"
prismcal train day03.csv day06.csv "${how[@]}" --out none.json --quiet || echo "exit $?"
prismcal train day02.csv "${how[@]}" --method ls --inputs T --out ls.json --quiet >/dev/null
prismcal compare ls.json model.json --on day13.csv "${how[@]}"
