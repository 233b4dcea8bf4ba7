# SPDX-License-Identifier: MIT
# A blocked disk is reported after 5 s, the status counts the pending rows, and no row is lost if the disk recovers. SIGTERM ends
# prismd within 5 s and prints the number of rows not written.
# History: no event, "0 dropped", SIGTERM waited 16 to 30 s, 20 rows were lost.
. "$(dirname "$0")/lib.sh"
on_a_shimmed_disk 1
echo hang >"$dir/disk"
begin=$(date +%s%N)
wait_for 7 grep -q 'the disk has not answered for' "$dir/prismd.err"
took=$((($(date +%s%N) - begin) / 1000000))
[ "$took" -lt 6500 ] || fail "reported after $took ms, expected about 5000 after the first blocked sync"
sleep "$(long 2 55)"
field_above .log.pending status 1 || fail "no pending row: $(field -c .log status)"
same "rows dropped" "$(field .log.dropped status)" 0
echo good >"$dir/disk"
wait_for 5 grep -q 'the disk answers again' "$dir/prismd.err"
wait_for 5 field_is .log.pending status 0
echo hang >"$dir/disk"
sleep 3.5
begin=$(date +%s%N)
kill -TERM "$prismd"
code=0; wait "$prismd" || code=$?
took=$((($(date +%s%N) - begin) / 1000000))
[ "$took" -lt 5000 ] || fail "SIGTERM took $took ms, expected less than 5000"
same "exit code" "$code" 1
contains "the last line on stderr" "$(tail -1 "$dir/prismd.err")" "rows were not written"
