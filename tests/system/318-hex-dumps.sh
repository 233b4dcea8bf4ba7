# SPDX-License-Identifier: MIT
# The bytes of a line as a text: each program refuses them with the command that writes the bytes.
. "$(dirname "$0")/lib.sh"
PATH=$PRISM_SOURCE/tools/prism-import:$PATH
prismsim --hours 0.1 --rate 200 --out a.pcap 2>/dev/null
python3 - <<'PY'
import struct
data, at, line = open("a.pcap", "rb").read(), 24, bytearray()
while at < len(data):
    length = struct.unpack_from("<I", data, at + 8)[0]
    line += data[at + 28:at + 16 + length]
    at += 16 + length
open("bytes", "wb").write(line)
open("one-line", "w").write(" ".join("%02X" % byte for byte in line))
open("digits", "w").write(line.hex())
open("terminal", "w").write("".join("[12:00:05.123] RX: %s\r\n" % line[i:i + 16].hex(" ") for i in range(0, len(line), 16)))
PY
xxd bytes >xxd-lines
echo '{"frames": "trplg"}' >gyro.json
code=0; prismcal inspect bytes 2>err || code=$?
same "inspect of bytes" "$code: $(cat err)" "1: prismcal: bytes: is a file of bytes; prismd --sniff bytes finds the frame description"
refused() { # NAME COMMAND...
  name=$1 code=0
  shift
  "$@" >out 2>err || code=$?
  same "$name: exit code" $code 1
  contains "$name: its message" "$(cat err)" "expected the bytes of the line; prism-import $form --hex --out line.bin writes them"
}
for form in one-line digits terminal xxd-lines; do
  refused "$form: inspect" prismcal inspect $form
  refused "$form: allan" prismcal allan $form
  refused "$form: train" prismcal train $form --config gyro.json --no-earth-rate --out model.json
  refused "$form: replay" prismd gyro.json --replay $form --out log
  refused "$form: sniff" prismd --sniff $form
  prism_import.py $form --hex --out line.bin >/dev/null
  cmp bytes line.bin || fail "$form: prism-import writes other bytes"
done
