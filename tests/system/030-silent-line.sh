# SPDX-License-Identifier: MIT
# An existing line without data is reported once, although prismd opens it repeatedly.
. "$(dirname "$0")/lib.sh"
config
start pty socat "PTY,link=$dir/tty,raw,echo=0" EXEC:"sleep 4"
wait_for 5 test -e "$dir/tty"
start_prismd
wait_for 5 field_is .state status silent
sleep 2
same "reports of the silence" "$(grep -c 'no data for' "$dir/prismd.err")" 1
contains "events" "$(prismctl events)" "no data for 1 s"
