# SPDX-License-Identifier: MIT
# prismd: --check of each shipped description, and the log of a capture with faults.
for file in "$SOURCE"/config/frames/[a-z]*.json; do
  case "$file" in *schema.json) continue ;; esac
  echo "== ${file##*/}"
  prismd --check "$file" || echo "exit $?"
done
capture a 0.5 3 --profile fast --damage-bytes 0.0005 --lose-frames 0.01 --drop-bytes 0.0002
sed 's/"clock"/"model": "tao2019-model2", "plausibility": {"temperature": {"stuck_s": 60}}, "clock"/' g.json >m.json
prismd m.json --replay a.pcap --out log | sed "s/ in .* million.s)//"
head -41 log/*.csv
tail -3 log/*.csv
