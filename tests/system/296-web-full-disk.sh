# SPDX-License-Identifier: MIT
# A full disk below the store of minutes, whenever it becomes full: stderr and the page's data give the real reason once, live data is
# served, and the store continues when there is space. History: the message was "No such file or directory".
. "$(dirname "$0")/lib.sh"
[ "$(id -u)" = 0 ] || skip "needs root for a small file system; unit tests check the message with failing calls"
frames 2
config
start_sim --profile fast --speed 1000
start_prismd
enough() { [ "$(field .log.rows status)" -gt 3000 ]; }
wait_for 30 enough
unmount() { umount -q "$dir"/state* 2>/dev/null || true; }
at_exit unmount
problem() { curl -s -H "Authorization: Bearer $token" "${url}api/gyro/range?seconds=100000&points=5" | jq -c '[.store_problem, (.rows | length > 0)]'; }
is_full() { problem | grep -q 'periods.sqlite: No space left on device",true'; }
is_good() { [ "$(problem)" = '[null,true]' ]; }
# From a disk without space for a directory to one that becomes full while the log is read.
for size in 4k 8k 16k 32k 64k 100k; do
  mkdir "state$size"
  mount -t tmpfs -o "size=$size" tmpfs "state$size" || skip "mount: no permission"
  start "web$size" prismweb --listen 127.0.0.1:0 --state "state$size" --instance "$PRISM_SOCKET"
  web=$pid
  wait_for 5 grep -q token= "web$size.out"
  url=$(sed 's/#.*//' "web$size.out") token=$(program_token "web$size.out")
  wait_for 15 is_full
  same "$size: messages" "$(sed "s|$dir/||" "web$size.err")" "prismweb: gyro z: state$size/gyro/z/periods.sqlite: No space left on device"
  [ "$size" = 64k ] || { kill -TERM "$web"; wait "$web" || true; continue; }
  mount -o remount,size=10m "state$size"
  wait_for 15 is_good
  same "$size: the end of the fault" "$(tail -1 "web$size.err")" "prismweb: gyro z: minutes and hours are stored again"
  kill -TERM "$web"; wait "$web" || fail "exit code $?"
done
