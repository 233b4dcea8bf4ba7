# SPDX-License-Identifier: MIT
# A crash and a hang: systemd starts the daemon again, and a client that knocks meanwhile is answered.
drop_in WatchdogSec=1s RestartSec=200ms   # in place of 10 s and 2 s
inside systemctl restart "$unit"
pid=$(property MainPID)
inside systemctl kill --kill-whom=main --signal=SEGV "$unit"
contains "a client that knocks during the restart is answered" "$(ask version 2>&1)" '"prismd"'
becomes 5 "a crash: started again" 1/active restarts_and_state
check "in a new process" test "$(property MainPID)" -ne "$pid"
becomes 5 "which has the gyro" receiving line_state
pid=$(property MainPID)
inside systemctl kill --kill-whom=main --signal=STOP "$unit"
becomes 10 "a hang: the watchdog ends it, and it is started again" 2/active restarts_and_state
contains "the journal names the watchdog" "$(journal)" "Watchdog timeout"
becomes 5 "it has the gyro again" receiving line_state
