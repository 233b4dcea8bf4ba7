# SPDX-License-Identifier: MIT
# The commands of "Several axes" in docs/operations.md work as printed.
. "$(dirname "$0")/lib.sh"
python3 - "$PRISM_SOURCE" <<'PY'
import re, sys
page = open(sys.argv[1] + '/docs/operations.md').read()
page = page[page.index('## Several axes'):].split('\n## ')[0]
lines = re.findall(r'^    \$ (.*)$', page[page.index('To practise'):], re.M)
assert len(lines) == 7, lines
text = '\n'.join(lines).replace('/usr/share/prism/examples', sys.argv[1] + '/config/examples')
open('page.sh', 'w').write(text + '\n')
PY
bash -e page.sh >out 2>page.err || fail "the page's commands end with $?: $(tail -20 out)"
for axis in x y z; do test -s "imu-model-$axis.json" -a -d "report-$axis" || fail "axis $axis has no model or report"; done
! grep -E 'is wrong|expected 10' page.err || fail "prismd complains about the rate"
