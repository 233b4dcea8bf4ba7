# SPDX-License-Identifier: MIT
# The complete chain at 600 times real time: virtual gyro, serial line, compensation, log and socket.
. "$(dirname "$0")/lib.sh"
frames 50
config
start_sim --profile paper --hours 1 --speed 600 --wait
start_prismd
wait_for 20 field_is .sample.quality status good
same "state" "$(field .state status)" receiving
contains "bias" "$(prismctl bias)" "deg/h"
field_is '.bias_deg_per_h | type' bias number || fail "bias is not a number: $(prismctl --json bias)"
wait "$sim"
wait_for 5 field_above .log.rows status 3500
[ "$(prismctl history --seconds 3600 | wc -l)" -gt 3500 ] || fail "the history has less than an hour: $(prismctl history --seconds 3600 2>&1 | tail -1)"
same "lost frames" "$(field .line.bad_check status)" 0
kill -TERM "$prismd"
wait "$prismd" || fail "SIGTERM: exit code $?"
[ ! -e "$PRISM_SOCKET" ] || fail "prismd did not remove its socket"
log=$dir/log.csv
# If the simulated hour passes midnight, the log has two segments. Keep only the first line of column names.
awk '!(/^time_utc/ && seen++)' "$dir"/log/gyro-*.csv >"$log"
same "first line" "$(head -c 8 "$log")" "# prism "
contains "columns" "$(grep -v '^#' "$log" | head -1)" "time_utc,time_s,samples"
same "rows without a corrected rate after warming" "$(grep -v '^#' "$log" | tail -n +150 | awk -F, '$15 == ""' | wc -l)" 0
same "rows with a corrected rate while warming" "$(grep -v '^#' "$log" | sed -n 2,100p | awk -F, '$15 != ""' | wc -l)" 0
! grep -qi 'nan\|inf' <(grep -v '^#' "$log") || fail "the log contains NaN or infinity"
