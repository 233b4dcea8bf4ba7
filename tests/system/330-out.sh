# SPDX-License-Identifier: MIT
# Corrected frames on lines, as the policies say, read at the far ends, through warm-up, reload, a removed model, an unplugged
# gyro, a reader that does not read, and a restart. A replay gives the bytes of the run.
. "$(dirname "$0")/lib.sh"
frames 20
far() { start "far-$1" python3 "$PRISM_SOURCE/tests/system/out_reader.py" "$2" "${3:-$dir/$1.bin}"; }
read_messages() { python3 "$PRISM_SOURCE/tests/system/out_reader.py" messages "$dir/$1.bin"; }
tcp=$(free_port) udp=$(free_port) address=$(free_port)
outputs() { # MODEL: a configuration with six outputs
  config "\"capture\": {\"directory\": \"$dir/capture\"}, \"out\": [
    {\"line\": {\"tcp\": {\"listen\": \"127.0.0.1:$tcp\"}}, \"frames\": \"same\", \"when_unknown\": \"raw\", \"unmarked\": true, \"capture\": true},
    {\"line\": {\"udp\": {\"address\": \"127.0.0.1:$udp\"}}, \"frames\": \"prism\", \"when_unknown\": \"raw\"},
    {\"line\": {\"device\": \"$dir/drop\"}, \"frames\": \"prism\", \"when_unknown\": \"drop\"},
    {\"line\": {\"device\": \"$dir/hold\"}, \"frames\": \"prism\", \"when_unknown\": \"hold\", \"hold_s\": 20},
    {\"line\": {\"device\": \"$dir/stuck\"}, \"frames\": \"dmu11\", \"when_unknown\": \"drop\"},
    {\"line\": {\"tcp\": {\"address\": \"127.0.0.1:$address\"}, \"retry_min_s\": 0.05, \"retry_max_s\": 0.1}, \"frames\": \"prism\", \"when_unknown\": \"drop\"}]"
  sed -i "s|\"model\": \"[^\"]*\"|\"model\": \"$1\"|" "$dir/gyro.json"
}
output() { field ".out[$(($1 - 1))].$2" status; } # NUMBER MEMBER, as texts count
output_above() { [ "$(output "$1" "$2")" -gt "$3" ]; }

# Wrong descriptions are refused in one line.
refused() { # WHAT CHANGE: jq's
  jq "$2" "$dir/gyro.json" >"$dir/wrong.json"
  ! prismd "$dir/wrong.json" --check >"$dir/wrong.txt" 2>&1 || fail "accepted: $2"
  contains "$2" "$(cat "$dir/wrong.txt")" "$1"
  same "lines of it" "$(wc -l <"$dir/wrong.txt")" 1
}
outputs "$PRISM_SOURCE/config/models/tao2019-model2.json"
contains "an output in words" "$(prismd "$dir/gyro.json" --check)" "output 4: $dir/hold, frames prism; without a correction: hold"
refused '/out/0/when_unknown: raw frames would look like corrected ones' 'del(.out[0].unmarked)'
refused 'tty is another line of this configuration' '.out[2].line.device = .line.device'
refused 'given together with "device"' '.line.tcp = {listen: "127.0.0.1:1"}'
refused '/out/1/line/udp/listen: an output has no sender' '.out[1].line.udp = {listen: "127.0.0.1:1"}'
refused '/out/2/hold_s: given without' '.out[2].hold_s = 1'
refused '/out/2: "frames" is missing' 'del(.out[2].frames)'
refused 'scpi-thermometer.json: found no gyro, expected one' '.out[4].frames = "scpi-thermometer"'
refused 'given without the configuration' 'del(.capture)'

# One run without a reload: warm-up, the correction, an unplugged gyro.
far tcp "tcp:$tcp"; far udp "udp:$udp"; far drop "pty:$dir/drop"; far hold "pty:$dir/hold"; far stuck "pty:$dir/stuck" /dev/null
wait_for 5 test -e "$dir/stuck"
start_prismd
wait_for 10 field_is ".out[0].state" status open
start_sim --profile fast --speed 50 --wait
wait_for 20 output_above 1 corrected 1000
wait_for 20 output_above 5 lost_bytes 1000
contains "the reader that does not read" "$(field ".health.problems" status)" "output 5: $dir/stuck: takes fewer bytes than the gyro sends"
contains "prismctl status" "$(prismctl status)" "outputs      tcp listening on 127.0.0.1:$tcp: open"
contains "the metrics" "$(prismctl metrics)" 'output="4",form="held"} 0'
kill -9 "$sim"; rm -f "$dir/tty"
wait_for 5 field_is .state status connecting
start_sim --profile fast --speed 50 --seed 8
rows=$(field .log.rows status)
wait_for 20 field_above .log.rows status $((rows + 130))
[ "$(field '.out[0].latency_p50_s > 0 and .out[0].latency_p99_s < 1' status)" = true ] || fail "latency: $(field '.out[0]' status)"
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"
python3 "$PRISM_SOURCE/tests/system/out_reader.py" capture "$dir"/capture/out-1/*.pcap >"$dir/captured.bin"
sleep 0.2
cmp "$dir/captured.bin" "$dir/tcp.bin" || fail "the capture of output 1 is not what its far end received"
replay=()
for file in "$dir"/capture/*.pcap; do replay+=(--replay "$file"); done
prismd "$dir/gyro.json" "${replay[@]}" --out "$dir/replayed" --out-frames "$dir/replayed.bin" >/dev/null || fail "the replay"
cmp "$dir/captured.bin" "$dir/replayed.bin" || fail "the replay sends other bytes than the run"
log_text "$dir"/log/*.csv >"$dir/live.csv"; log_text "$dir"/replayed/*.csv >"$dir/replayed.csv"
cmp "$dir/live.csv" "$dir/replayed.csv" || fail "the log of the replay differs"

# Every frame left, each in its form: raw until the window is full, then towards the correction, then with it.
read_messages udp >"$dir/udp.txt"; read_messages drop >"$dir/drop.txt"; read_messages hold >"$dir/hold.txt"
python3 - "$dir" <<'END' || fail "the messages"
import csv, sys
def rows(name):
    return [[float(word) for word in line.split()] for line in open(f"{sys.argv[1]}/{name}.txt")]
RAW, HELD, FADING, FADE = 1 << 18, 1 << 17, 1 << 16, 0.001
raw, drop, hold = rows("udp"), rows("drop"), rows("hold")
kinds = {int(row[6]) & (RAW | HELD | FADING) for row in raw}
assert kinds == {0, RAW, FADING}, kinds
assert [row[1] for row in raw] == list(range(len(raw))), "each message has the next number"
for one, two in zip(raw, raw[1:]):
    if int(two[6]) & FADING:
        step = abs(two[4] - one[4])
        assert step <= FADE * 0.0501 + 1e-12, f"a step of {step} while it fades at {two[2]}"
assert all(row[4] == 0 for row in raw if int(row[6]) & RAW), "a raw rate has no correction"
assert not any(int(row[6]) & (RAW | HELD) for row in drop), "nothing leaves without a correction"
assert drop[0][6] == 0 and drop[0][2] >= raw[0][2] + 99, "the first correction needs no fade, nothing was sent before"
full = {row[2]: row[4] for row in raw if row[6] == 0}
assert all(abs(full[row[2]] - row[4]) < 1e-9 for row in drop if row[6] == 0 and row[2] in full)
log = list(csv.DictReader(line for line in open(f"{sys.argv[1]}/live.csv") if not line.startswith("#")))
good = [row for row in log if row["quality"] == "good" and row["sent_deg_per_h"]]
same = [row for row in good if abs(float(row["sent_deg_per_h"]) - float(row["corrected_deg_per_h"])) < 5e-6]
assert len(good) > 50 and len(same) > 3, "after the fade the corrected rate is sent"
warming = [row for row in log if row["quality"] == "warming"]
assert warming[5]["sent_deg_per_h"] == warming[5]["rate_deg_per_h"], "raw is sent as measured"
END

# A reload to another model fades, a removed one ends as the policy says, and a restart goes on.
for child in "${children[@]}"; do kill -9 "$child" 2>/dev/null || true; done
wait 2>/dev/null || true
rm -rf "$dir"/*.bin "$dir"/{tty,drop,hold,stuck,log,capture}
far udp "udp:$udp"; far drop "pty:$dir/drop"; far hold "pty:$dir/hold"; far stuck "pty:$dir/stuck"
for name in drop hold stuck; do wait_for 5 test -e "$dir/$name"; done
start_sim --profile fast --speed 50 --wait
start_prismd
wait_for 20 output_above 2 corrected 200
# A far end that is not there, comes, ends, and comes again: no message is cut.
for turn in first again; do

  wait_for 5 field_is '.out[5].state' status connecting
  contains "no far end" "$(field .health.problems status)" "output 6: tcp 127.0.0.1:$address: "
  far $turn "accept:$address"
  arrived() { [ "$(wc -c <"$dir/$turn.bin")" -gt 880 ]; }
  wait_for 10 arrived
  kill "${children[-1]}"
done
for turn in first again; do
  head -c $(($(wc -c <"$dir/$turn.bin") / 44 * 44)) "$dir/$turn.bin" >"$dir/whole.bin"
  read_messages whole >"$dir/whole.txt" && test -s "$dir/whole.txt" || fail "$turn: other bytes than messages"
done
cp "$PRISM_SOURCE/config/models/tao2019-model1.json" "$dir/other.json"
outputs "$dir/other.json"
fading=$(output 2 fading)
prismctl reload >/dev/null
wait_for 20 output_above 2 fading "$fading"
corrected=$(output 2 corrected)
wait_for 20 output_above 2 corrected "$corrected"
outputs "$dir/other.json"; sed -i 's|"model": "[^"]*",||' "$dir/gyro.json"
prismctl reload >/dev/null
dropped=$(output 4 dropped)
wait_for 20 output_above 4 dropped "$dropped"
output_above 4 held 100 || fail "held: $(field '.out[3]' status)"
kill -9 "$prismd"
outputs "$PRISM_SOURCE/config/models/tao2019-model2.json"
start_prismd
wait_for 20 output_above 3 corrected 100
for name in udp drop hold; do read_messages "$name" >/dev/null || fail "$name"; done
