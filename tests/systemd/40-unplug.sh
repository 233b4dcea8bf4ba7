# SPDX-License-Identifier: MIT
# The gyro is unplugged and plugged in again: the daemon keeps running, reports both and reconnects.
pid=$(property MainPID)
unplug
becomes 5 "unplugged: the status names the missing device" /dev/gyro0: line_state
same "the unit has not failed or restarted" "$(property ActiveState)/$(property NRestarts)" "active/0"
plug
becomes 5 "replugged: the gyro sends data again" receiving line_state
same "the process is the same" "$(property MainPID)" "$pid"
same "a client receives samples again" "$(ask watch --samples --count 10 2>&1 | grep -c rate_deg_per_h)" 10
