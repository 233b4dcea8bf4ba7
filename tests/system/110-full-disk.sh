# SPDX-License-Identifier: MIT
# A full disk: rows are dropped and counted, one message reports it, and rows are written again when there is space.
. "$(dirname "$0")/lib.sh"
[ "$(id -u)" -eq 0 ] || skip "needs root to mount a small file system"
mkdir "$dir/small"
mount -t tmpfs -o size=64k tmpfs "$dir/small" 2>/dev/null || skip "cannot mount a tmpfs here"
unmount() { umount -l "$dir/small"; }
at_exit unmount
frames 20
config
sed -i "s|$dir/log|$dir/small/log|" "$dir/gyro.json"
start_sim --profile steady --speed 300
start_prismd
wait_for 20 field_above .log.dropped status 50
same "reports of the full disk" "$(grep -c 'cannot be written' "$dir/prismd.err")" 1
same "health" "$(field .health.state status)" failed
echo "$(field '.health.problems[]' status)" | grep -qE 'log: .*: No space left on device; rows are dropped.* \([0-9]+ rows since 20[0-9T:-]*Z\)' || fail "problems: $(field .health status)"
for file in "$dir"/small/log/*.csv; do
  same "incomplete rows" "$(grep -v '^#' "$file" | awk -F, 'NR == 1 { columns = NF } NF != columns' | wc -l)" 0
  same "complete rows" "$([ "$(grep -c '^[0-9]' "$file")" -gt 0 ] && echo some)" some
  same "last byte" "$(tail -c 1 "$file" | xxd -p)" 0a
done
mount -o remount,size=4m "$dir/small"
wait_for 5 grep -q 'writing again after' "$dir/prismd.err"
wait_for 5 field_is '.health.problems | map(select(.text | startswith("log:"))) | length' status 0
same "state" "$(field .state status)" receiving
