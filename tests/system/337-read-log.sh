# SPDX-License-Identifier: MIT
# prism.read_log: one axis of a log as a DataFrame, without the rows that a later segment repeats; the lines of docs/clients.md for Octave, Excel and HDF5.
. "$(dirname "$0")/lib.sh"
/usr/bin/python3 -c 'import pandas' 2>/dev/null || skip "python3-pandas is not installed"
export PYTHONPATH=$PRISM_SOURCE/clients/python PYTHONDONTWRITEBYTECODE=1
mkdir log
segment() { # AXIS NUMBER FIRST-SECOND [SUPERSEDES]
  local file=log/g-$1-00000$2-20260101T00000$2Z.csv
  printf '# prism 0.4.0 data log, format 2\n# gyro_serial: 70-1\n# axis: %s\n# session: 2026-01-01T00:00:00Z\n%s' "$1" "${4:+# supersedes: $4
}" >"$file"
  echo 'time_utc,time_s,samples,rate_deg_per_h,slope_degc_per_s,quality,partial' >>"$file"
  for second in 0 1 2; do echo "2026-01-01T00:00:0$((second + $3))Z,$((1767225600 + second + $3)),1,$2.$second,,$([ $second = 1 ] && echo good || echo warming),0" >>"$file"; done
}
segment x 1 1
segment x 2 3 "g-x-000001-20260101T000001Z.csv from row 3"
segment y 3 1
/usr/bin/python3 - <<'END' || fail "read_log"
import prism
log = prism.read_log("log", axis="x")
assert list(log.rate_deg_per_h) == [1.0, 1.1, 2.0, 2.1, 2.2], log
assert log.index.is_unique and str(log.index[0]) == "2026-01-01 00:00:01+00:00", log.index
assert log.attrs["units"] == {"samples": "", "rate_deg_per_h": "deg/h", "slope_degc_per_s": "degC/s", "quality": "", "partial": ""}, log.attrs
assert log.attrs["gyro_serial"] == "70-1" and log.slope_degc_per_s.isna().all() and (log.quality == "good").sum() == 2
assert list(prism.read_log("log", axis="y", columns=["rate_deg_per_h"]).columns) == ["rate_deg_per_h"]
for wrong in (None, "z"):
    try:
        prism.read_log("log", axis=wrong)
        raise SystemExit("accepted")
    except ValueError as error:
        assert "x, y" in str(error), error
END
/usr/bin/python3 -c 'import h5py, openpyxl' 2>/dev/null || skip "python3-h5py or python3-openpyxl is not installed"
sed -n '/^    import prism, h5py/,/^$/s/^    //p' "$PRISM_SOURCE/docs/clients.md" | sed 's|/srv/recordings/gyro1|log|; s/axis="z"/axis="x"/' >recipe.py
[ -s recipe.py ] || fail "docs/clients.md has no recipe"
/usr/bin/python3 recipe.py || fail "the recipe of docs/clients.md"
/usr/bin/python3 - <<'END' || fail "the files of the recipe"
import h5py, openpyxl
with h5py.File("gyro1.h5") as file:
    assert list(file["rate_deg_per_h"]) == [1.0, 1.1, 2.0, 2.1, 2.2] and file["rate_deg_per_h"].attrs["unit"] == "deg/h"
    assert file["time_s"][0] == 1767225601
rows = list(openpyxl.load_workbook("gyro1.xlsx").active.values)
assert len(rows) == 6 and rows[0][2] == "rate_deg_per_h", rows
END
command -v octave-cli >/dev/null || skip "octave is not installed"
sed -n '/^Octave has/,/^## /s/^    //p' "$PRISM_SOURCE/docs/clients.md" | sed 's|gyro1-.*csv |log/g-x-000002-*.csv |; s/^plot(\(.*\))$/shown = [\1]/; s/corrected_mean_deg_per_h/rate_deg_per_h/' >recipe.m
echo 'printf("%d %g\n", shown'"'"')' >>recipe.m
printf '#!/bin/sh\necho '"'"'{"rate_deg_per_h": 1.5}'"'"'\n' >prismctl && chmod +x prismctl
sed -n '/^    \[status/,/jsondecode/s/^    //p' "$PRISM_SOURCE/docs/clients.md" >json.m
echo 'printf("%g\n", bias.rate_deg_per_h)' >>json.m
contains "jsondecode in Octave" "$(PATH=$PWD:$PATH octave-cli json.m 2>/dev/null)" 1.5
contains "the recipe for Octave" "$(octave-cli recipe.m 2>/dev/null | tail -3 | tr '\n' ';')" "1767225603 2;1767225604 2.1;1767225605 2.2;"
contains "HDF5 in Octave" "$(octave-cli --eval 'load("gyro1.h5"); printf("%g;", rate_deg_per_h)' 2>/dev/null)" "1;1.1;2;2.1;2.2;"
