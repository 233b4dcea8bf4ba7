# SPDX-License-Identifier: MIT
# An existing line without data is reported once, although prismd opens it repeatedly.
. "$(dirname "$0")/lib.sh"
config
sed -i 's/"silence_s": 1/"silence_s": 0.1/' "$dir/gyro.json"
start pty socat "PTY,link=$dir/tty,raw,echo=0" EXEC:cat
wait_for 5 test -e "$dir/tty"
start_prismd
wait_for 5 field_is .state status silent
sleep 1  # several attempts
same "reports of the silence" "$(grep -c 'no data for' "$dir/prismd.err")" 1
contains "events" "$(prismctl events)" "no data for 0.1 s"
