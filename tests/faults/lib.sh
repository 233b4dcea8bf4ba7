# SPDX-License-Identifier: MIT
# Functions of the fault tests, in addition to tests/system/lib.sh. Each test injects real faults into the running programs.
. "$PRISM_SOURCE/tests/system/lib.sh"
export ASAN_OPTIONS=verify_asan_link_order=0:${ASAN_OPTIONS:-}  # the preloaded libraries come before the sanitizer's
# on_a_shimmed_disk ROWS [SETTINGS]: starts a simulated gyro, and prismd with disk_shim.cpp controlled by $dir/disk ("good" at first).
# Returns when more than ROWS rows are logged; $prismd is prismd's process.
on_a_shimmed_disk() {
  config "${2:-}"
  start_sim --profile steady --speed 1
  echo good >"$dir/disk"
  start prismd env LD_PRELOAD="$PRISM_BIN/tests/libdisk_shim.so" PRISM_DISK="$dir/disk" prismd "$dir/gyro.json"
  prismd=$pid
  wait_for 10 field_above .log.rows status "$1"
}
# ended PID: succeeds if this child of the script has ended.
ended() { ! kill -0 "$1" 2>/dev/null; }
# grows FILTER METHOD COUNT: waits until this number is COUNT larger than now.
grows() { wait_for $((5 + 2 * $3)) field_above "$1" "$2" $(($(field "$1" "$2") + $3 - 1)); }
# sanitized: succeeds if prismd was built with a sanitizer; its memory use is then not checked.
sanitized() { grep -q "lib[atu]b*san" <<<"$(ldd "$PRISM_BIN/daemon/prismd")"; }
# long QUICK LONG: prints QUICK, or LONG in the long form (PRISM_ENDURANCE=1).
long() { [ -n "${PRISM_ENDURANCE:-}" ] && echo "$2" || echo "$1"; }
