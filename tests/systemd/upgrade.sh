#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Upgrades the packages of version 0.1 or 0.3, with its configuration, models and logs, to the new packages while the gyro runs.
# Then each key of 0.3 that 0.4 removed (base/removed_keys.cpp): prismd continues with a warning, and prismweb opens no door.
# usage: upgrade.sh VERSION OLD NEW      two directories with prism_*.deb and prism-tools_*.deb, in NEW also prism-web_*.deb (tools/check --system)
# Exit code 0 if every check passed, 1 if one failed, 77 if no container can run here.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
. "$here/container.sh"
trap container_down EXIT
. "$here/checks.sh"
. "$here/gyro.sh"

[ $# -eq 3 ] || { echo "upgrade.sh: found $# arguments, expected VERSION OLD NEW" >&2; exit 64; }
was=$1
shift
obstacle=$(container_obstacle)
[ -z "$obstacle" ] || { echo "skipped: no container can run here: $obstacle"; exit 77; }
binds=(--bind-ro="$(realpath "$2/prism-web"_*.deb)":/new-web.deb)
for age in old new; do
  for package in prism prism-tools; do
    binds+=(--bind-ro="$(realpath "$1/$package"_*.deb)":/$age-$package.deb)
  done
  shift
done
container_up "${binds[@]}"
set +e   # from here on, a failure is a line of the report

version() { inside dpkg-query --show --showformat='${Version}' prism; }
log=/var/log/private/prismd/gyro1
bias() { inside prismctl --json bias | jq .bias_deg_per_h; }
corrects() { [[ "$(bias)" =~ ^-?[0-9] ]]; }
rows() { inside sh -c "cat $log/*.csv | grep -c '^[0-9]'"; }
more_rows_than() { test "$(rows)" -gt "$1"; }
sums() { inside sh -c 'sha256sum /etc/prism/gyro1.json /etc/prism/models/own-*.json'; }
eventually() { local what=$1; shift; becomes 20 "$what" 0 exit_code "$@"; }

# The image has no gnuplot, which 0.1 depends on.
check "$was installs" inside dpkg --force-depends --install /old-prism.deb /old-prism-tools.deb
old=$(version)
contains "the installed version is $was" "$old" "$was."
inside sh -c 'sed "s/\"rate_hz\": 200/\"rate_hz\": 20/" /usr/share/prism/frames/trplg.json >/frames.json && chmod 644 /frames.json'
check "$was simulates a recording" inside sh -c \
  'mkdir -p /old && cd /old && prismsim --frames /frames.json --profile second --hours 2 --out run.pcap && echo "{\"frames\": \"/frames.json\", \"clock\": \"device\"}" >run.json'
for method in ls lssvm; do
  check "$was trains a model ($method)" inside prismcal train /old/run.pcap --config /old/run.json --method $method --inputs T --no-earth-rate \
    $([ $method = ls ] || echo --c 10 --sigma2 1) \
    --window 5 --end-mean 2 --max-gap 2 --force --out /etc/prism/models/own-$method.json
done
inside sh -c 'cat >/etc/prism/gyro1.json' <<'END'
{"line": {"device": "/dev/gyro0", "silence_s": 1, "retry_min_s": 0.05, "retry_max_s": 0.2}, "frames": "/frames.json",
 "gyro": {"serial": "70-0123"}, "model": "own-lssvm", "capture": {"keep_days": 30}}
END
plug
check "$was runs" inside systemctl enable --now "$socket" "$unit"
becomes 10 "the gyro sends data" receiving line_state
eventually "$was corrects the rate" corrects
eventually "$was logs rows" more_rows_than 5
model=$(inside prismctl --json model | jq -r .id)
bias=$(bias)
configuration=$(sums)
pid=$(property MainPID)
logged=$(rows)
check "the log of $was is copied" inside cp -a "$log" /old/log

check "the new packages upgrade it" inside dpkg --install /new-prism.deb /new-prism-tools.deb
refuse "the installed version has changed" test "$(version)" = "$old"
becomes 10 "the instance is active, with a new process" active state_after "$pid" "$unit"
becomes 5 "the gyro sends data again" receiving line_state
same "configuration and models are unchanged" "$(sums)" "$configuration"
same "no configuration file of $was is obsolete" \
  "$(inside dpkg-query --show --showformat='${Conffiles}\n' prism prism-tools | grep obsolete)" ""
same "systemd has no failed unit" "$(inside systemctl list-units --failed --no-legend)" ""
same "the model keeps its id" "$(inside prismctl --json model | jq -r .id)" "$model"
eventually "the log continues in the same directory" more_rows_than $((logged + 5))
eventually "the new version corrects the rate" corrects
check "its bias is that of $was" jq -en --argjson a "$bias" --argjson b "$(bias)" '($a - $b) | fabs < 0.02'
check "a reload loads the other model of $was" inside sh -c 'sed -i s/own-lssvm/own-ls/ /etc/prism/gyro1.json && prismctl reload'

check "prismd reloads with removed keys" inside sh -c \
  'sed -i "s|\"device\": \"/dev/gyro0\"|&, \"serve\": {\"raw\": {\"tcp\": {\"listen\": \"127.0.0.1:5001\"}}}|; s|\"capture\": {|\"log\": {\"keep_for\": \"relay\"}, &|" /etc/prism/gyro1.json && prismctl reload'
check "prismd starts with removed keys" inside systemctl restart "$unit"
becomes 10 "prismd receives with removed keys" receiving line_state
for key in line/serve log/keep_for; do contains "prismd warns of $key" "$(inside prismctl events)" "/$key: removed in prism 0.4"; done
# Keys of frame descriptions and of a lot that could change a number: exit 78, and the replacement.
while read -r change; do
  sed 's|^ *//.*||' config/frames/trplg.json | jq "$change" | inside sh -c 'cat >/old.json; echo "{\"frames\": \"/old.json\"}" >/old-gyro.json'
  same "its exit code with $change" "$(inside sh -c 'prismd --check /old-gyro.json >/dev/null 2>/old.err; echo $?')" 78
  contains "its message with $change" "$(inside cat /old.err)" ": removed in prism 0.4"
done <<'END'
.stuffing = {"type": "slip"}
.vectors[0].stuffed = "C0"
.kinds[0].length = {"at": 2, "multiply": 2}
.kinds[0].checks.word_order = "little"
.kinds[0].checks.covers_mark = true
.kinds[0].fields.temperature.convert = [{"coefficients": [0, 1]}]
.kinds[0].fields.temperature.convert = [{"a": 1}]
END
inside sh -c 'cat >/lot.json' <<<'{"format": "prism-campaign", "version": 1, "slurm": {}, "level": "x86-64-v3"}'
same "the exit code of a lot of 0.3" "$(inside sh -c 'prismcal campaign /lot.json >/dev/null 2>/old.err; echo $?')" 78
contains "its message" "$(inside cat /old.err)" "/level: removed in prism 0.4"
# web.json MEMBERS: writes a configuration of 0.3.
web_config() { inside sh -c 'cat >/etc/prism/web.json' <<<"{$1}"; }
web_runs() { inside systemctl is-active prismweb.service; }
check "prismweb's package installs" inside dpkg --install /new-web.deb
for members in '"listen": "0.0.0.0:8467"' '"tls": {"certificate": "web.crt", "key": "web.key"}' '"passwords": "web.passwords"'; do
  web_config "$members"
  inside systemctl reset-failed prismweb.service
  refuse "prismweb does not start with $members" inside systemctl start prismweb.service
  same "its exit code with $members" "$(property ExecMainStatus prismweb.service)" 78
  contains "its message with $members" "$(inside journalctl --unit prismweb.service --lines 5 --output cat)" 'nginx or caddy'
done
web_config '"foxglove": {}, "plotjuggler": {"send_to": "127.0.0.1:9870"}'
inside systemctl reset-failed prismweb.service
check "prismweb starts with foxglove and plotjuggler" inside systemctl start prismweb.service
same "prismweb is active" "$(web_runs)" active
same "its warnings" "$(inside journalctl --unit prismweb.service --output cat | grep -c 'warning: .*removed in prism 0.4')" 2
inside systemctl stop prismweb.service

inside systemctl stop "$socket" "$unit"
check "the rows of $was are unchanged" \
  inside sh -c "cd /old/log && for file in *.csv; do cmp --bytes=\$(stat -c %s \$file) \$file $log/\$file || exit 1; done"
same "no complete second is in the log twice" \
  "$(inside sh -c "cat $log/*.csv | grep '^[0-9].*[^1]$' | cut -d, -f2 | sort | uniq -d | wc -l")" 0
[ "$was" != 0.1 ] || check "the directory has both formats" \
  inside sh -c "[ -n \"\$(grep -l 'format 2' $log/*.csv)\" ] && [ -n \"\$(grep -L 'format 2' $log/*.csv)\" ]"
check "verify finds no fault" inside prismcal verify "$log"
check "evaluate reads the log" inside prismcal evaluate /etc/prism/models/own-ls.json "$log" --no-earth-rate
check "allan reads the log" inside prismcal allan "$log"
check "train reads the log" \
  inside prismcal train "$log" --method ls --inputs T --no-earth-rate --window 1 --max-gap 2 --force --out /old/new.json
verdict
