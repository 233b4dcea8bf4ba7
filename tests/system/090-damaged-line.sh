# SPDX-License-Identifier: MIT
# Random, dropped and damaged bytes cost only the frames that they hit, and are counted; prismd keeps running.
. "$(dirname "$0")/lib.sh"
config
start_sim --profile steady --speed 50 --drop-bytes 1e-3 --damage-bytes 1e-3
start_prismd
wait_for 20 field_is .sample.quality status good
wait_for 5 field_above .line.bad_check status 10
wait_for 5 field_above .timing.missing_frames status 10
wait_for 5 field_above .line.skipped_bytes status 100
contains "line" "$(prismctl line)" "by checksum"
same "hardware counters of a pty" "$(field .hardware line)" null
kill "$sim"; rm -f "$dir/tty"
head -c 3000000 /dev/urandom >"$dir/garbage"
start pty socat "PTY,link=$dir/tty,raw,echo=0" "SYSTEM:cat $dir/garbage -"
wait_for 5 field_above .line.skipped_bytes status 2900000
kill -0 "$prismd" || fail "prismd ended"
