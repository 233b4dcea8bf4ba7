#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Version 0.1's packages, with a configuration, models and logs that it wrote, become these ones while the gyro runs.
# usage: upgrade.sh OLD NEW      two folders with prism_*.deb and prism-tools_*.deb (tools/check --system)
# Exits with 0 where every check passed, 1 where one failed, 77 where no container can run here.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
. "$here/container.sh"
trap container_down EXIT
. "$here/checks.sh"
. "$here/gyro.sh"

[ $# -eq 2 ] || { echo "upgrade.sh: found $# arguments, expected OLD NEW" >&2; exit 64; }
obstacle=$(container_obstacle)
[ -z "$obstacle" ] || { echo "skipped: no container can run here: $obstacle"; exit 77; }
binds=()
for age in old new; do
  for package in prism prism-tools; do
    binds+=(--bind-ro="$(realpath "$1/$package"_*.deb)":/$age-$package.deb)
  done
  shift
done
container_up "${binds[@]}"
set +e   # from here on a failure is a line of the report

version() { inside dpkg-query --show --showformat='${Version}' prism; }
log=/var/log/private/prismd/gyro1
bias() { inside prismctl --json bias | jq .bias_deg_per_h; }
corrects() { [[ "$(bias)" =~ ^-?[0-9] ]]; }
rows() { inside sh -c "cat $log/*.csv | grep -c '^[0-9]'"; }
more_rows_than() { test "$(rows)" -gt "$1"; }
sums() { inside sh -c 'sha256sum /etc/prism/gyro1.json /etc/prism/models/own-*.json'; }
eventually() { local what=$1; shift; becomes 20 "$what" 0 exit_code "$@"; }

check "0.1 installs" inside dpkg --install /old-prism.deb /old-prism-tools.deb
old=$(version)
contains "it is 0.1" "$old" 0.1.
inside sh -c 'sed "s/\"rate_hz\": 200/\"rate_hz\": 20/" /usr/share/prism/frames/trplg.json >/frames.json && chmod 644 /frames.json'
check "0.1 simulates a recording" inside sh -c \
  'mkdir -p /old && cd /old && prismsim --frames /frames.json --profile second --hours 2 --out run.pcap && echo "{\"frames\": \"/frames.json\", \"clock\": \"device\"}" >run.json'
for method in ls lssvm; do
  check "0.1 trains a model ($method)" inside prismcal train /old/run.pcap --config /old/run.json --method $method --inputs T --no-earth-rate \
    $([ $method = ls ] || echo --c 10 --sigma2 1) \
    --window 5 --end-mean 2 --max-gap 2 --force --out /etc/prism/models/own-$method.json
done
inside sh -c 'cat >/etc/prism/gyro1.json' <<'END'
{"line": {"device": "/dev/gyro0", "silence_s": 1, "retry_min_s": 0.05, "retry_max_s": 0.2}, "frames": "/frames.json",
 "gyro": {"serial": "70-0123"}, "model": "own-lssvm", "capture": {"keep_days": 30}}
END
plug
check "0.1 runs" inside systemctl enable --now "$socket" "$unit"
becomes 10 "the gyro delivers" receiving line_state
eventually "0.1 corrects" corrects
eventually "0.1 logs" more_rows_than 5
model=$(inside prismctl --json model | jq -r .id)
bias=$(bias)
configuration=$(sums)
pid=$(property MainPID)
logged=$(rows)
check "a copy of what 0.1 wrote until now" inside cp -a "$log" /old/log

check "the new packages install over it" inside dpkg --install /new-prism.deb /new-prism-tools.deb
refuse "and are newer" test "$(version)" = "$old"
becomes 5 "the instance is up" active property ActiveState
check "in a new process" test "$(property MainPID)" -ne "$pid"
becomes 5 "the gyro delivers again" receiving line_state
same "configuration and models are untouched" "$(sums)" "$configuration"
same "no file of 0.1's configuration is left behind" "$(inside dpkg-query --show --showformat='${Conffiles}\n' prism prism-tools | grep obsolete)" ""
same "systemd has no failed unit" "$(inside systemctl list-units --failed --no-legend)" ""
same "the model keeps its id" "$(inside prismctl --json model | jq -r .id)" "$model"
eventually "it logs on in the same folder" more_rows_than $((logged + 5))
eventually "it corrects" corrects
check "by the bias that 0.1 knew" jq -en --argjson a "$bias" --argjson b "$(bias)" '($a - $b) | fabs < 0.02'
check "a reload takes 0.1's other model" inside sh -c 'sed -i s/own-lssvm/own-ls/ /etc/prism/gyro1.json && prismctl reload'

inside systemctl stop "$socket" "$unit"
check "what 0.1 wrote stands as it was" inside sh -c "cd /old/log && for file in *.csv; do cmp --bytes=\$(stat -c %s \$file) \$file $log/\$file || exit 1; done"
same "no whole second stands in it twice" "$(inside sh -c "cat $log/*.csv | grep '^[0-9].*[^1]$' | cut -d, -f2 | sort | uniq -d | wc -l")" 0
check "the folder has both formats" inside sh -c "[ -n \"\$(grep -l 'format 2' $log/*.csv)\" ] && [ -n \"\$(grep -L 'format 2' $log/*.csv)\" ]"
check "verify finds no fault" inside prismcal verify "$log" /etc/prism/gyro1.json
check "evaluate reads it" inside prismcal evaluate /etc/prism/models/own-ls.json "$log" --no-earth-rate
check "allan reads it" inside prismcal allan "$log"
check "train reads it" inside prismcal train "$log" --method ls --inputs T --no-earth-rate --window 1 --max-gap 2 --force --out /old/new.json
verdict
