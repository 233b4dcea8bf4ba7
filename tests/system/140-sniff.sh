# SPDX-License-Identifier: MIT
# --sniff finds the description that fits an unknown line or capture; --check checks single descriptions and models.
. "$(dirname "$0")/lib.sh"
start_sim --profile steady --speed 1
contains "a live line" "$(prismd --sniff "$dir/tty")" "trplg"
head -c 100000 /dev/urandom >"$dir/noise"
code=0; prismd --sniff "$dir/noise" >"$dir/o" || code=$?
same "exit code for noise" "$code" 1
contains "noise" "$(cat "$dir/o")" "nothing fits"
code=0; prismd --sniff "$dir/none" 2>"$dir/e" || code=$?
same "exit code for a missing file" "$code" 1
contains "error for a missing file" "$(cat "$dir/e")" "none: cannot be read"
for file in "$PRISM_SOURCE"/config/frames/*.json; do
  case "$file" in *.schema.json) continue ;; esac
  contains "$file" "$(prismd --check "$file")" " hold"
done
sed 's/63 4D"/63 4E"/' "$PRISM_SOURCE/config/frames/trplg.json" >"$dir/f.json"
code=0; prismd --check "$dir/f.json" 2>"$dir/e" || code=$?
same "exit code for a wrong test vector" "$code" 78
# A check that fits in the other byte order: the message has the keys.
sed 's/"at": -2}/"at": -2, "order": "little"}/' "$PRISM_SOURCE/config/frames/trplg.json" >"$dir/f.json"
code=0; prismd --check "$dir/f.json" 2>"$dir/e" || code=$?
same "exit code for a wrong byte order" "$code" 78
contains "a wrong byte order" "$(cat "$dir/e")" 'it fits with "order": "big"'
# A check that never fits: the message has the keys of the usual variant that does.
plain() { sed 's|^ *//.*||' "$PRISM_SOURCE/config/frames/trplg.json"; }
prismsim --profile steady --hours 0.01 --out "$dir/v.pcap" 2>/dev/null
explained() { # JQ KEYS
  plain | jq "del(.vectors) | .kinds[0].checks |= (. + {$1})" >"$dir/v.json"
  contains "$1" "$(prismd --sniff "$dir/v.pcap" "$dir/v.json")" "candidates of \"data\": sync and length fit, the check does not: found"
  contains "$1" "$(prismd --sniff "$dir/v.pcap" "$dir/v.json")" "it fits with $2"
}
explained 'from: 2' '"from": 0'
explained 'order: "little"' '"order": "big"'
explained 'poly: "0x8005"' '"poly": "0x1021"'
explained 'poly: "0x8005", from: 2, init: "0x0000"' '"from": 0, "poly": "0x1021", "init": "0xFFFF"'
plain | jq '.kinds[0].checks = {kind: "sum", width: 16, from: 0, to: -2, at: -2} | del(.vectors)' >"$dir/v.json"
contains "another kind of check" "$(prismd --sniff "$dir/v.pcap" "$dir/v.json")" "no usual variant fits"
contains "no vectors" "$(prismd --check "$dir/v.json")" "no test vector: nothing is proved"
contains "another name than the file's" "$(prismd --check "$dir/v.json")" 'finds it by its file, "v"; its name "trplg" is in logs'
# The rate of a gyro that is set up for another one than its description, also if it sends increments.
for frames in trplg trplg-increment; do
  echo "{\"line\": {\"device\": \"/dev/null\"}, \"frames\": \"$frames\", \"rate_hz\": 10}" >"$dir/r.json"
  contains "rate_hz of $frames" "$(prismd --check "$dir/r.json")" "frames $frames (10 Hz)"
done
# Exponents, hexadecimal digits: the descriptions for tests and their captures.
for file in "$PRISM_SOURCE"/tests/replay/frames/described/*.json; do
  name=$(basename "$file" .json)
  contains "$name: vectors" "$(prismd --check "$file")" "good: frames $name"
  contains "$name: capture" "$(prismd --sniff "$PRISM_SOURCE/tests/replay/frames/$name.pcap" "$file")" " fits "
done
contains "model" "$(prismd --check "$PRISM_SOURCE/config/models/tao2019-model1.json")" "good: model"

# --sniff tries the descriptions of all directories that prismd searches, or only the one that is given.
mkdir -p "$dir/data/frames"
sed 's/"name": "trplg"/"name": "mine"/' "$PRISM_SOURCE/config/frames/trplg.json" >"$dir/data/frames/mine.json"
prismsim --profile steady --hours 0.01 --out "$dir/c.pcap" 2>/dev/null
contains "a capture" "$(prismd --sniff "$dir/c.pcap")" "trplg              fits"
contains "a description in PRISM_DATA" "$(PRISM_DATA=$dir/data prismd --sniff "$dir/c.pcap")" "mine               fits"
contains "a shipped description with PRISM_DATA set" "$(PRISM_DATA=$dir/data prismd --sniff "$dir/c.pcap")" "trplg              fits"
same "a description given by its path" "$(prismd --sniff "$dir/c.pcap" "$dir/data/frames/mine.json" | grep -c 'fits ')" 1
code=0; prismd --sniff "$dir/c.pcap" kvh1750 >"$dir/o" || code=$?
same "another description given by name: exit code" "$code" 1
code=0; prismd --sniff "$dir/c.pcap" kvh175 >"$dir/o" 2>"$dir/e" || code=$?
same "a mistyped name: exit code" "$code" 1
contains "a mistyped name" "$(cat "$dir/e")" 'DESCRIPTION: found "kvh175", did you mean "kvh1750"? Looked for kvh175.json in '

# One or two frames are too few to be sure; the message differs from that for no frames.
prismsim --profile steady --hours 0.01 --frames kvh1750 --out "$dir/k.pcap" 2>/dev/null
contains "enough frames" "$(prismd --sniff "$dir/k.pcap" kvh1750)" "kvh1750            fits"
head -c 116 "$dir/k.pcap" | tail -c 36 >"$dir/one"  # after the headers of file, packet and record
code=0; prismd --sniff "$dir/one" kvh1750 >"$dir/o" || code=$?
same "one frame: exit code" "$code" 1
contains "one frame" "$(cat "$dir/o")" "one frame, too few to be sure"

# A description fits only if its frames contain an angular rate.
status='{"name": "status", "sync": {"at": 0, "bytes": "A5 5A 01 14"}, "length": 20, "fields": {"counter": {"at": 4, "type": "u16"}}}'
sed -e 's/A5 5A 01 14"}/A5 5A 02 14"}/' -e "s/\"kinds\": \[/&$status,/" "$PRISM_SOURCE/config/frames/trplg.json" >"$dir/still.json"
code=0; prismd --sniff "$dir/c.pcap" "$dir/still.json" >"$dir/o" 2>&1 || code=$?
same "no angular rate: exit code" "$code" 1
contains "no angular rate" "$(cat "$dir/o")" ": none with a rate"

# A network capture is rejected as by --replay; the message states how to extract the bytes.
printf '\324\303\262\241\002\000\004\000\000\000\000\000\000\000\000\000\377\377\000\000\001\000\000\000' >"$dir/net.pcap"
code=0; prismd --sniff "$dir/net.pcap" >"$dir/o" 2>"$dir/e" || code=$?
same "a network capture: exit code" "$code" 1
contains "a network capture" "$(cat "$dir/e")" "found a capture of link type 1 (EN10MB), expected 250 (serial line); to extract bytes of TCP: tshark"

# A replay that finds no frame fails.
config
code=0; prismd "$dir/gyro.json" --replay "$dir/k.pcap" --out "$dir/none" >"$dir/o" 2>"$dir/e" || code=$?
same "a replay without a frame: exit code" "$code" 1
contains "a replay without a frame" "$(cat "$dir/e")" 'found no frame of "trplg" in '

# A wrong frame rate is reported with the host clock: the line has 20 frames/s, the description states 10.
frames 20; prismsim --profile steady --hours 0.02 --frames "$dir/frames.json" --out "$dir/20.pcap" 2>/dev/null
frames 10; config '"socket": {"path": ""}'
sed -i 's/"clock": "device", "accept_clock": true/"clock": "host"/; s/, "socket": {"path": "[^"]*"}, /, /' "$dir/gyro.json"
code=0; prismd "$dir/gyro.json" --replay "$dir/20.pcap" --out "$dir/wrong" >"$dir/o" 2>"$dir/e" || code=$?
contains "a wrong rate" "$(cat "$dir/e")" "frames arrive at 20.00 a second, the description says 10 (rate_hz)"
