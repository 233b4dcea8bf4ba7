# SPDX-License-Identifier: MIT
# The three-axis example of docs/frames.md works as printed: files and commands are taken from the page.
. "$(dirname "$0")/lib.sh"
python3 - "$PRISM_SOURCE/docs/frames.md" <<'PY'
import re, sys
page = open(sys.argv[1]).read()
page = page[page.index('### Three axes'):page.index('## 2. Reference')]
for name, text in zip(re.findall(r'`([a-z0-9]+\.json)`(?:,|:| joins)', page), re.findall(r'```json\n(.*?)```', page, re.S)):
    open(name, 'w').write(text)
lines = re.findall(r'^    \$ (.*)$', page, re.M)
assert len(lines) == 5, lines
open('check.sh', 'w').write(lines[0] + '\n')
open('start.sh', 'w').write('\n'.join(f'{line.removesuffix("&")} >{i}.log 2>&1 & echo $! >>pids' for i, line in enumerate(lines[1:4])) + '\n')
open('ask.sh', 'w').write(lines[4] + '\n')
PY
ls fog.json fog3.json thermometer.json >/dev/null
bash check.sh >checked || fail "--check: $(cat checked)"
contains "no vector" "$(cat checked)" "fog3, no test vector: nothing is proved"
bash start.sh
read -ra children < <(xargs <pids)
PRISM_SOCKET=$dir/fog.sock
status_has() { bash ask.sh >status 2>&1 && grep -q "$1" status; }
wait_for 30 status_has 'chamber.air'
has_air() { [ "$(field '.sensors["chamber.air"].value > -100' status)" = true ]; }
wait_for 20 has_air
invalid() { [[ $(field ".axes.$1.quality" status) == *rate_invalid* ]]; }
wait_for 60 invalid y
! invalid x || fail "x is invalid, too"
wait_for 60 field_is .axes.y.quality status no_model
