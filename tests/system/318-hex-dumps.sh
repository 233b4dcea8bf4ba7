# SPDX-License-Identifier: MIT
# The bytes of a line as a text: prismcal reads every form to the same seconds as the bytes themselves, and asks for a description.
. "$(dirname "$0")/lib.sh"
PATH=$PRISM_BIN/tools/prismcal:$PATH
cd "$dir"
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
code_of() { code=0; "$@" || code=$?; echo $code; }
judged() { prismcal train "$1" --config gyro.json --no-earth-rate --out model.json 2>&1 | grep -v "$1" || true; }
judged bytes >expected
contains "the judgement of the bytes" "$(cat expected)" "temperature_span"
for form in one-line digits terminal xxd-lines; do
  contains "$form: inspect" "$(prismcal inspect $form)" "$form: hex dump; 1 frame description fits"
  judged $form >got
  diff expected got || fail "$form: train judges other seconds than those of the bytes"
  same "$form: without a configuration" "$(code_of prismcal train $form --out model.json 2>train.err)" 1
  contains "$form: its message" "$(cat train.err)" "$form: is a hex dump; expected --config"
done
same "inspect names the command" "$(prismcal inspect bytes | grep -c 'then: prismcal train bytes --config gyro.json')" 1
