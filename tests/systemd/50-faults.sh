# SPDX-License-Identifier: MIT
# systemd restarts the daemon after a crash or a stall; a client that connects meanwhile gets its response.
drop_in WatchdogSec=1s RestartSec=200ms   # instead of 10 s and 2 s
inside systemctl restart "$unit"
pid=$(property MainPID)
inside systemctl kill --kill-whom=main --signal=SEGV "$unit"
contains "a client that connects during the restart gets its response" "$(ask version 2>&1)" '"prismd"'
becomes 5 "crash: systemd restarts the daemon" 1/active restarts_and_state
becomes 5 "the process is new" active state_after "$pid" "$unit"
becomes 5 "the new process receives data of the gyro" receiving line_state
pid=$(property MainPID)
inside systemctl kill --kill-whom=main --signal=STOP "$unit"
becomes 10 "stall: the watchdog ends the daemon, and systemd restarts it" 2/active restarts_and_state
contains "the journal names the watchdog" "$(journal)" "Watchdog timeout"
becomes 5 "the daemon receives data of the gyro again" receiving line_state
