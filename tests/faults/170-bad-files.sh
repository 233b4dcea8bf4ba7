# SPDX-License-Identifier: MIT
# Files that cannot be used: a pipe, a device, a huge file, a file server that does not respond, a bad block of the disk. Each causes one
# line with the path and the reason, with little memory and without a wait for the file. History: a pipe blocked every program, and during a reload the
# log; /dev/zero used up all memory; a read error ended prismcal with SIGABRT.
. "$(dirname "$0")/lib.sh"
shim=$PRISM_BIN/tests/libdisk_shim.so
mkfifo pipe.json pipe.csv pipe.pcap
ln -s /dev/zero zero.json
truncate -s 1T huge.json
truncate -s 5M large.json
{ printf '{'; seq -f '"%.0f": 1,' 100000; printf '"x": 1}'; } >keys.json
{ printf '%0100000d' 0 | tr 0 '['; } >deep.json
config

# one_line WHAT EXPECTED COMMAND...: the command fails within 700 MB of address space (and a minute), with one line on stderr that contains
# EXPECTED.
one_line() {
  local what=$1 expected=$2 code=0; shift 2
  (ulimit -v 700000; timeout 60 "$@" >out 2>err) || code=$?
  case $code in 1 | 78) ;; *) fail "$what: exit code $code: $(tail -2 err)" ;; esac
  same "$what: lines" "$(wc -l <err)" 1
  contains "$what" "$(cat err)" "$expected"
}
for file in pipe.json:'is a pipe, expected a regular file' zero.json:'is a device, expected a regular file' huge.json:'is larger than' .:'is a directory, expected a regular file' \
  keys.json:'an object has more than 10000 keys in line 1' deep.json:'nested deeper than 32 levels'; do
  one_line "configuration $file" "${file#*:}" prismd "${file%%:*}" --check
done
one_line "a configuration of 5 MiB" 'large.json: is larger than 4 MiB' prismd large.json
for model in pipe.json zero.json; do one_line "model $model" "$model: is a" prismd gyro.json --model "$dir/$model" --check; done
sed "s|$dir/frames.json|$dir/pipe.json|" gyro.json >piped.json
one_line "frames" "pipe.json: is a pipe" prismd piped.json --check
one_line "capture" "pipe.pcap: is a pipe" prismd gyro.json --replay pipe.pcap --out replayed
for command in allan 'train --no-earth-rate --out m.json'; do one_line "$command" "pipe.csv" prismcal ${command%% *} pipe.csv ${command#"${command%% *}"}; done
code=0; timeout 60 prismcal verify pipe.csv >out 2>err || code=$?
same "exit code of verify" "$code" 1
contains "verify" "$(cat out err)" "is a pipe, expected a regular file"
one_line "a campaign" "pipe.json: is a pipe" prismcal campaign pipe.json

# A bad block in a log: the programs print the reason, and verify lists it with its line.
frames 2
echo '{"frames": "./frames.json", "clock": "device", "name": "g"}' >plain.json
prismsim --profile steady --hours 0.2 --frames frames.json --out cycle.pcap 2>sim.err
prismd plain.json --replay cycle.pcap --out log >/dev/null 2>&1
log=$(ls "$dir"/log/*.csv)
bad() { env LD_PRELOAD="$shim" PRISM_BAD_BLOCK="$log:30000" "$@"; }
code=0; bad prismcal allan log >out 2>err || code=$?
same "exit code of a bad block" "$code" 1
contains "a bad block" "$(cat err)" "cannot be read: Input/output error"
same "lines" "$(wc -l <err)" 1
code=0; bad prismcal verify log >out 2>err || code=$?
same "exit code of verify of a bad block ($(cat err))" "$code" 1
contains "verify of a bad block" "$(cat out)" "damaged: cannot be read: Input/output error"
code=0; env LD_PRELOAD="$shim" PRISM_BAD_BLOCK="$dir/cycle.pcap:9000" prismd plain.json --replay cycle.pcap --out again >out 2>err || code=$?
[ "$code" -le 1 ] || fail "a capture with a bad block: exit code $code: $(tail -3 err)"
code=0; env LD_PRELOAD="$shim" PRISM_BAD_BLOCK="$dir/gyro.json:10" prismd gyro.json --check 2>err || code=$?
same "a configuration with a bad block" "$code $(cat err)" "78 prismd: gyro.json: cannot be read: Input/output error"

# A reload whose file cannot be read yet: logging continues, and the reload ends when the file server responds again.
frames 50
start_sim --profile steady
echo good >disk
start prismd env LD_PRELOAD="$shim" PRISM_DISK="$dir/disk" PRISM_BAD_BLOCK="$dir/gyro.json:100000" prismd "$dir/gyro.json"
wait_for 10 field_above .log.rows status 3
echo stall >disk
kill -HUP "$pid"
sleep 0.3
rows=$(field .log.rows status)
wait_for 10 field_above .log.rows status "$((rows + 2))"
! grep -q 'reloaded' prismd.err || fail "the reload did not wait for its file"
echo good >disk
wait_for 5 grep -q 'reloaded: ' prismd.err
