# SPDX-License-Identifier: MIT
# The socket is systemd's, the daemon comes with the first client, and a person without rights gets the data.
inside sh -c 'sed "s/\"rate_hz\": 200/\"rate_hz\": 50/" /usr/share/prism/frames/trplg.json >/frames.json && chmod 644 /frames.json'
configuration='{"line": {"device": "/dev/gyro0", "silence_s": 1, "retry_min_s": 0.05, "retry_max_s": 0.2}, "frames": "/frames.json", "model": "tao2019-model2"}'
inside sh -c 'cat >/etc/prism/gyro1.json' <<<"$configuration"
plug
check "the socket is enabled and started" inside systemctl enable --now "$socket"
same "the daemon waits for the first client" "$(property ActiveState)" inactive
same "mode, owner and group of the socket" "$(inside stat -c '%A %U:%G' "$address")" "srw-rw---- root:prism"
check "a link says that systemd listens" inside test -L /run/prismd/activated/gyro1.sock
refuse "nothing says that it runs" inside test -e /run/prismd/running/gyro1
contains "a stranger is refused" "$(stranger socat -u "UNIX-CONNECT:$address" STDOUT 2>&1)" "Permission denied"
same "the stranger did not start the daemon" "$(property ActiveState)" inactive
contains "a member's question starts the daemon" "$(ask version 2>&1)" '"prismd"'
becomes 5 "the daemon is active" active property ActiveState
check "its folder says that it runs" inside test -d /run/prismd/running/gyro1
same "what systemd was told" "$(property Type)/$(property NotifyAccess)/$(property Restart)/$(property WatchdogUSec)" "notify/main/on-failure/10s"
becomes 5 "it tells systemd that the gyro delivers" receiving line_state
same "a member without rights receives samples" "$(ask watch --samples --count 50 2>&1 | grep -c rate_deg_per_h)" 50
contains "prismctl finds the only instance by itself" "$(client prismctl status 2>&1)" "gyro1"
contains "a member may not reload" "$(ask reload 2>&1)" "needs root"
check "root may reload" inside prismctl reload
check "the daemon runs as a user of its own" test "$(inside ps -o user= -p "$(property MainPID)")" != root
same "its log is in the folder of its own" "$(inside sh -c 'ls /var/log/prismd/gyro1/*.csv | wc -l')" 1
same "that folder is closed to others" "$(inside stat -c %A /var/log/private/prismd/gyro1 2>&1)" "drwxr-x---"
