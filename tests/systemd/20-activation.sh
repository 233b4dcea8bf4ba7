# SPDX-License-Identifier: MIT
# systemd owns the socket, the first client starts the daemon, and an unprivileged member of the group gets data.
inside sh -c 'sed "s/\"rate_hz\": 200/\"rate_hz\": 50/" /usr/share/prism/frames/trplg.json >/frames.json && chmod 644 /frames.json'
configuration='{"line": {"device": "/dev/gyro0", "silence_s": 1, "retry_min_s": 0.05, "retry_max_s": 0.2}, "frames": "/frames.json", "model": "tao2019-model2"}'
inside sh -c 'cat >/etc/prism/gyro1.json' <<<"$configuration"
plug
check "the socket is enabled and started" inside systemctl enable --now "$socket"
same "the daemon waits for the first client" "$(property ActiveState)" inactive
same "mode, owner and group of the socket" "$(inside stat -c '%A %U:%G' "$address")" "srw-rw---- root:prism"
check "a link marks the socket as systemd's" inside test -L /run/prismd/activated/gyro1.sock
refuse "the instance is not marked as running" inside test -e /run/prismd/running/gyro1
contains "a user outside the group is rejected" "$(stranger socat -u "UNIX-CONNECT:$address" STDOUT 2>&1)" "Permission denied"
same "this user did not start the daemon" "$(property ActiveState)" inactive
contains "a request of a group member starts the daemon" "$(ask version 2>&1)" '"prismd"'
becomes 5 "the daemon is active" active property ActiveState
check "its directory marks it as running" inside test -d /run/prismd/running/gyro1
same "type, notify access, restart and watchdog of the unit" \
  "$(property Type)/$(property NotifyAccess)/$(property Restart)/$(property WatchdogUSec)" "notify/main/on-failure/10s"
becomes 5 "its status shows that the gyro sends data" receiving line_state
same "an unprivileged member receives samples" "$(ask watch --samples --count 50 2>&1 | grep -c rate_deg_per_h)" 50
contains "prismctl finds the only instance without an option" "$(client prismctl status 2>&1)" "gyro1"
contains "a member may not reload" "$(ask reload 2>&1)" "needs root"
check "root may reload" inside prismctl reload
check "the daemon does not run as root" test "$(inside ps -o user= -p "$(property MainPID)")" != root
same "its log is in its directory" "$(inside sh -c 'ls /var/log/prismd/gyro1/*.csv | wc -l')" 1
rows_synced() { ask status | jq '[.. | .log? | objects | .rows - .unsynced] | max > 0'; }
becomes 30 "rows are on the disk" true rows_synced
contains "a member copies the log" "$(client sh -c 'prismctl export /tmp/of-a-member && prismcal verify /tmp/of-a-member' 2>&1)" "intact files: 1"
same "other users cannot read that directory" "$(inside stat -c %A /var/log/private/prismd/gyro1 2>&1)" "drwxr-x---"
