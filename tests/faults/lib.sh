# SPDX-License-Identifier: MIT
# What the tests of faults share beyond tests/system/lib.sh. Each fault is injected for real. PRISM_ENDURANCE=1 runs the long form:
# long QUICK LONG gives the number that the form takes.
. "$PRISM_SOURCE/tests/system/lib.sh"
PATH=$PRISM_BIN/tools/prismcal:$PATH
export ASAN_OPTIONS=verify_asan_link_order=0:${ASAN_OPTIONS:-}  # what injects a fault is loaded before a sanitizer's library
# on_a_shimmed_disk ROWS [SETTINGS]: a simulated gyro and prismd on a disk that does what the word in $dir/disk says, good at first; prismd's
# process is $prismd. Returns when so many rows are logged and one more.
on_a_shimmed_disk() {
  config "${2:-}"
  start_sim --profile steady --speed 1
  echo good >"$dir/disk"
  start prismd env LD_PRELOAD="$PRISM_BIN/tests/libdisk_shim.so" PRISM_DISK="$dir/disk" prismd "$dir/gyro.json"
  prismd=$pid
  wait_for 10 field_above .log.rows status "$1"
}
# sanitized: prismd was built with a sanitizer, whose memory is not its own and not judged.
sanitized() { ldd "$PRISM_BIN/daemon/prismd" | grep -q 'lib[atu]b*san'; }
long() { [ -n "${PRISM_ENDURANCE:-}" ] && echo "$2" || echo "$1"; }
