# SPDX-License-Identifier: MIT
# From the serial line to the corrected rate: a virtual gyro in fast time, its bias compensated, in a log and on a socket.
. "$(dirname "$0")/lib.sh"
frames 50
config
start_sim --profile paper --hours 1 --speed 600 --wait
start_prismd
wait_for 20 field_is .sample.quality status good
same "state" "$(field .state status)" receiving
contains "bias" "$(prismctl bias)" "deg/h"
field_is '.bias_deg_per_h | type' bias number || fail "bias is no number: $(prismctl --json bias)"
wait "$sim"
wait_for 5 field_above .log.rows status 3500
[ "$(prismctl history --seconds 3600 | wc -l)" -gt 3500 ] || fail "an hour of history: $(prismctl history --seconds 3600 2>&1 | tail -1)"
same "lost frames" "$(field .line.bad_check status)" 0
kill -TERM "$prismd"
wait "$prismd" || fail "SIGTERM: exit code $?"
[ ! -e "$PRISM_SOCKET" ] || fail "the socket is left behind"
log=$dir/log.csv
# Two segments where the simulated hour passes midnight, each with its columns.
awk '!(/^time_utc/ && seen++)' "$dir"/log/gyro-*.csv >"$log"
same "first line" "$(head -c 8 "$log")" "# prism "
contains "columns" "$(grep -v '^#' "$log" | head -1)" "time_utc,time_s,samples"
same "rows without a number for the corrected rate after warming" "$(grep -v '^#' "$log" | tail -n +150 | awk -F, '$15 == ""' | wc -l)" 0
same "rows while warming with one" "$(grep -v '^#' "$log" | sed -n 2,100p | awk -F, '$15 != ""' | wc -l)" 0
! grep -qi 'nan\|inf' <(grep -v '^#' "$log") || fail "a number that is none in the log"
