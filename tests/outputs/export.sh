# SPDX-License-Identifier: MIT
# Models as C: the files, what is said of them, what is refused.
log a 6 3 --profile fast
log b 6 4 --profile fast
export_c() { echo "== $*"; prismcal export --c c "$@" || echo "exit $?"; }
prismcal train a --inputs T --method stepwise --out m.json --quiet >/dev/null
export_c m.json --extrapolation clamp
show c/prism_model.h
prismcal train a --method lssvm --c 50 --sigma2 1 --out k.json --quiet >/dev/null
export_c k.json
export_c k.json --float --max-bytes 700 --on b
grep -v 0x c/prism_model.h
grep -c 0x c/prism_model.h
gcc -std=c99 c/prism_predict.c c/prism_selftest.c -lm -o selftest
./selftest
export_c k.json --max-bytes 60 --on b
export_c m.json --max-bytes 80 --on b
export_c k.json --max-bytes 700
export_c k.json --on b
export_c k.json --max-bytes 700 --on nothing
export_c k.json --max-bytes 700 --on b --leave-out 90000000..
export_c k.json --extrapolation shrink
awk 'BEGIN {print "x,y"; for (i = 0; i < 40; ++i) print i "," i * i}' >t.csv
prismcal fit t.csv --target y --inputs x --method ls --out t.json --quiet >/dev/null
export_c t.json
export_c "$SOURCE/config/models/tao2019-model2.json"
sed -nE 's/^ *\{(\{[^}]*\}).*/\1/p' c/prism_pairs.h | sed -n '1,10p' # the usual ranges, the last of a larger box
python3 - <<'END' # a grid over the box of the usual ranges
import re
points = [[float.fromhex(x) for x in line.split(", ")] for line in re.findall(r"^ *\{\{([^}]*)\}", open("c/prism_pairs.h").read(), re.M)]
parts = [((t + 40) / 100, (slope + 0.02) / 0.04, (u - 3) / 4) for t, slope, u in points]
print(len({tuple(int(3 * x) for x in part) for part in parts if all(0 <= x < 1 for x in part)}), "of 27 cells have a point")
END
export_c nothing.json
prismcal export k.json --c /proc/c || echo "exit $?"
