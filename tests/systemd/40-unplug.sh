# SPDX-License-Identifier: MIT
# The gyro is pulled and put back: the daemon stays, says so, and takes it up again.
pid=$(property MainPID)
unplug
becomes 5 "unplugged: the status names the device that is gone" /dev/gyro0: line_state
same "and systemd sees no failure" "$(property ActiveState)/$(property NRestarts)" "active/0"
plug
becomes 5 "replugged: it delivers again" receiving line_state
same "the process is the same" "$(property MainPID)" "$pid"
same "samples flow again" "$(ask watch --samples --count 10 2>&1 | grep -c rate_deg_per_h)" 10
