# SPDX-License-Identifier: MIT
# A blocked disk is reported after 3 s, the status counts the pending rows, and no row is lost if the disk recovers. SIGTERM ends
# prismd all the same and prints the number of rows not written.
# History: no event, "0 dropped", SIGTERM waited 16 to 30 s, 20 rows were lost.
. "$(dirname "$0")/lib.sh"
on_a_shimmed_disk 1
echo hang >"$dir/disk"
wait_for 7 grep -q 'the disk has not answered for' "$dir/prismd.err"
sleep "$(long 0 55)"
wait_for 5 field_above .log.pending status 1
same "rows dropped" "$(field .log.dropped status)" 0
echo good >"$dir/disk"
wait_for 5 grep -q 'the disk answers again' "$dir/prismd.err"
wait_for 5 field_is .log.pending status 0
echo hang >"$dir/disk"
wait_for 5 field_above .log.pending status 1
kill -TERM "$prismd"
wait_for 5 ended "$prismd"
code=0; wait "$prismd" || code=$?
same "exit code" "$code" 1
contains "the last line on stderr" "$(tail -1 "$dir/prismd.err")" "rows were not written"
