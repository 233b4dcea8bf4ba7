# SPDX-License-Identifier: MIT
# Raw bytes (without arrival times) of each shipped description whose frames have several lengths give the rate and the frames a
# second of the capture that they were taken from. History: their pace was that of the longest frame, so that VectorNav had 609
# samples in a second at 200 Hz and increments gave 1.65 times the rate, without a message.
. "$(dirname "$0")/../system/lib.sh"
. "$PRISM_SOURCE/tests/replay/slow_motion.sh"
frames=$PRISM_SOURCE/tests/replay/frames
tested=0
for name in dsp3000-ascii hg1120 hg4930 ixblue-phins-nmea ixblue-stdbin kvh-geo-fog kvh1750 microstrain-mip novatel-rawimusx stim210 \
  stim300 vectornav xsens-mtdata2; do
  slow_motion "$PRISM_SOURCE/config/frames/$name.json" >"$dir/frames.json"
  echo "{\"name\": \"$name\", \"frames\": \"$dir/frames.json\", \"clock\": \"host\"}" >"$dir/gyro.json"
  python3 - "$frames/$name.pcap" "$dir/$name.bytes" <<'END'
import struct, sys
data = open(sys.argv[1], "rb").read()
at, out = 24, bytearray()
while at + 16 <= len(data):
    length = struct.unpack_from("<I", data, at + 8)[0]
    record = data[at + 16 : at + 16 + length]
    if record[8] == 1 or record[8] == 2:  # data received or sent; 12 bytes of header precede the bytes of the line
        out += record[12:]
    at += 16 + length
open(sys.argv[2], "wb").write(out)
END
  for kind in pcap bytes; do
    [ "$kind" = pcap ] && file=$frames/$name.pcap || file=$dir/$name.bytes
    rm -rf "$dir/log"
    prismd "$dir/gyro.json" --replay "$file" --out "$dir/log" >"$dir/$kind.out" 2>"$dir/prismd.err" || fail "$name: exit code $?"
    cat "$dir"/log/*.csv >"$dir/$kind.csv"
  done
  python3 - "$name" "$dir/pcap.csv" "$dir/bytes.csv" <<'END' || fail "$name: see above"
import csv, statistics, sys
def rows(path):
    lines = [l for l in open(path) if not l.startswith("#")]
    return [r for r in csv.DictReader(lines) if r["rate_deg_per_h"] and "partial" not in r["quality"] and r["partial"] in ("", "0")]
name, capture, raw = sys.argv[1], rows(sys.argv[2]), rows(sys.argv[3])
rate = [[float(r["rate_deg_per_h"]) for r in x] for x in (capture, raw)]
count = [statistics.median(int(r["samples"]) for r in x) for x in (capture, raw)]
mean = [statistics.mean(x) for x in rate]
allowed = 0.01 * abs(mean[0]) + 3 * statistics.pstdev(rate[0]) / len(rate[0]) ** 0.5
print(f"{name}: {count[0]} and {count[1]} frames a second, {mean[0]:.3f} and {mean[1]:.3f} deg/h, allowed {allowed:.3f}")
assert abs(count[1] - count[0]) <= 1 and abs(mean[1] - mean[0]) <= allowed and len(raw) >= len(capture) - 2, (len(capture), len(raw))
END
  tested=$((tested + 1))
done
[ "$tested" -ge 10 ] || fail "found $tested descriptions with several lengths, expected 10 or more"

# Four message types of one length, one of them with the rate: 60 frames are 60 s, not 240.
kinds=$(for i in 1 2 3 4; do echo "{\"name\": \"k$i\", \"sync\": {\"bytes\": \"AA 5$i 77 88\"}, \"length\": 6, \"fields\": {\"n$i\": {\"at\": 4, \"type\": \"u16\"}}},"; done)
echo "{\"format\": \"prism-frames\", \"version\": 1, \"name\": \"x\", \"line\": {\"baud\": 9600}, \"rate_hz\": 1, \"kinds\": [${kinds%,}],
  \"gyro\": {\"meaning\": \"rate\", \"unit\": \"deg/h\", \"axes\": {\"z\": \"n1\"}}}" >"$dir/x.json"
echo "{\"frames\": \"$dir/x.json\", \"clock\": \"host\"}" >"$dir/gyro.json"
python3 -c 'import sys; open(sys.argv[1], "wb").write(b"".join(bytes.fromhex("AA527788%04XAA5177880001AA5377880003AA5477880004" % i) for i in range(60)))' "$dir/x"
rm -rf "$dir/log"; prismd "$dir/gyro.json" --replay "$dir/x" --out "$dir/log" >/dev/null 2>"$dir/prismd.err" || fail "four message types: exit code $?"
same "seconds of four message types" "$(awk -F, '/^[12]/ {if (!first) first = $2; last = $2} END {print last - first}' "$dir"/log/*.csv)" 59
