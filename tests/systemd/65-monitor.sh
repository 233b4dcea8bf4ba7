# SPDX-License-Identifier: MIT
# The daily check of a model: its timer is enabled as in docs/guide.md; its service reads the log as the instance's user, cannot write it, and
# leaves its verdict where prismd shows it.
aged=prismd@aged.service monitor=prism-monitor@aged.service timer=prism-monitor@aged.timer
guide=$(cat "$here/../../docs/guide.md")
inside sh -c 'sed "s/^  \"provenance\"/  \"rate_noise\": {\"n_deg_per_sqrt_h\": 0.01, \"b_deg_per_h\": 0, \"second_deg_per_h\": 0.7},\n  \"monitor\": {\"every\": 1, \"sd_deg_per_h\": 0.05, \"offset_deg_per_h\": 0.01, \"correlation\": 0, \"threshold\": 20, \"delay_h\": 30},\n&/" \
  /usr/share/prism/models/tao2019-model2.json >/etc/prism/aged-model.json'
inside sh -c 'cat >/etc/prism/aged.json' <<'END'
{"line": {"device": "/dev/gyro2"}, "frames": "/frames.json", "clock": "device", "accept_clock": true, "model": "./aged-model.json",
 "site": {"latitude_deg": 34.25, "elevation_deg": 90}}
END
inside systemd-run --quiet --collect --unit=gyro2 prismsim --link /dev/gyro2 --frames /frames.json --profile steady --speed 100
becomes 5 "another gyro: the line exists" 0 exit_code inside test -e /dev/gyro2
inside sh -c 'chgrp dialout "$(readlink -f /dev/gyro2)" && chmod 660 "$(readlink -f /dev/gyro2)"'
aged_status() { inside prismctl --name aged --json status; }
rows_of_aged() { aged_status | jq '.log.rows > 300'; }
check "its instance starts" inside systemctl start prismd@aged.socket "$aged"
becomes 30 "its log has rows" true rows_of_aged
same "systemd-analyze verify prints no warnings about the check" "$(inside systemd-analyze verify --man=no "$monitor" "$timer" 2>&1)" ""
check "exposure of the check is at most 0.4" \
  inside systemd-analyze security --offline=true --threshold=4 --no-pager /usr/lib/systemd/system/prism-monitor@.service
command="systemctl enable --now prism-monitor@gyro1.timer"
contains "docs/guide.md has: $command" "$guide" "$command"
check "this command succeeds for it" inside sh -c "${command/gyro1/aged}"
same "the timer is enabled and waits" "$(property UnitFileState "$timer")/$(property SubState "$timer")" enabled/waiting
check "the timer's next time is known" test -n "$(property NextElapseUSecRealtime "$timer")"
check "the check succeeds" inside systemctl start "$monitor"
verdict_file=/var/lib/private/prismd/aged/monitor.json
contains "its verdict is in its file" "$(inside cat $verdict_file 2>&1)" '"verdict": "too_little"'
same "the file belongs to the user of the instance" "$(inside stat -c '%u %A' $verdict_file)" "$(inside stat -c %u /var/lib/private/prismd/aged) -rw-------"
contains "the journal has the sentence" "$(journal "$monitor")" "too little seen"
inside systemctl restart "$aged"   # prismd reads the file at its start, then once a minute
verdict_shown() { aged_status | jq -r '[.. | .monitor? | objects | .verdict] | first'; }
becomes 10 "prismctl status has the verdict" too_little verdict_shown
contains "prismctl status shows it" "$(inside prismctl --name aged status)" "too little seen"
inside sh -c "mkdir -p /run/systemd/system/$monitor.d && cat >/run/systemd/system/$monitor.d/test.conf && systemctl daemon-reload" \
  < <(printf '%s\n' '[Service]' ExecStart= "ExecStart=/usr/bin/touch /var/log/prismd/aged/x" NoExecPaths=)
refuse "the check cannot write the log" inside systemctl start "$monitor"
contains "because it is read-only" "$(journal "$monitor")" "Read-only file system"
inside sh -c "rm -r /run/systemd/system/$monitor.d && systemctl daemon-reload && systemctl reset-failed $monitor"
inside systemctl stop "$timer" prismd@aged.socket "$aged" gyro2   # the timer stays enabled: 90-remove tests that purge leaves nothing of it
inside rm /etc/prism/aged.json /etc/prism/aged-model.json
