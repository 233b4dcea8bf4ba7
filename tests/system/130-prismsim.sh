# SPDX-License-Identifier: MIT
# prismsim as a program: the same command writes the same files, SIGINT ends it cleanly, errors have their exit code and message.
. "$(dirname "$0")/lib.sh"

# The same seed gives the same gyro, another seed another one.
for name in a b; do prismsim --hours 0.1 --seed 3 --out $name.pcap --truth $name.csv 2>$name.err; done
prismsim --hours 0.1 --seed 4 --out c.pcap 2>c.err
cmp a.pcap b.pcap && cmp a.csv b.csv || fail "the same command gave two different files"
! cmp -s a.pcap c.pcap || fail "another seed gave the same file"
same "last line of stderr" "$(tail -1 a.err)" "prismsim: a.pcap: 72000 simulated frames"
same "first line of the truth" "$(head -1 a.csv)" "# simulated: the truth of a virtual gyro, not a measurement"
same "rows of the truth" "$(grep -c '^2026' a.csv)" 360

# The truth file and the log of the capture have the same seconds: an undamaged capture loses none.
config
prismd gyro.json --replay a.pcap --out replayed 2>replay.err
log=$(echo replayed/*.csv)
same "seconds of log and truth" "$(grep -v '^#' "$log" | tail -n +2 | cut -d, -f1 | head -359)" "$(grep '^2026' a.csv | cut -d, -f1 | head -359)"

# Ctrl-C: exit code 0, the link is removed, the capture written so far is valid.
start_sim --hours 10
wait_for 2 test -s sim.out  # prismsim makes the link before it prints the path
same "printed path" "$(head -1 sim.out)" "$(readlink tty)"
kill -INT "$sim"
wait "$sim" || fail "SIGINT: exit code $?"
[ ! -L tty ] || fail "prismsim did not remove the link"
start long prismsim --hours 1000 --out long.pcap
grown() { [ "$(stat -c %s long.pcap)" -gt 100000 ]; }  # frames, not only the capture's header
wait_for 20 grown
kill -INT "$pid"
wait "$pid" || fail "SIGINT while writing: exit code $?"
contains "last message" "$(tail -1 long.err)" "simulated frames"
prismd gyro.json --replay long.pcap --out long 2>torn.err
! grep -qi 'truncated\|damage' torn.err || fail "the capture of an interrupted run is truncated: $(cat torn.err)"

# Errors.
refused() {
  local code=$1 words=$2 found=0; shift 2
  prismsim "$@" >refused.out 2>refused.err || found=$?
  same "exit code of prismsim $*" "$found" "$code"
  same "last line of prismsim $*" "$(tail -n 1 refused.err)" "$words"
}
refused 64 "prismsim: expected one of --out FILE (a capture), --pty (a pseudo-terminal), --tcp, --tcp-listen and --udp; see prismsim --help"
refused 64 "prismsim: --profile: found profile \"x\", expected one of paper, second, third, beyond, fast, steady, warm-up" --out x.pcap --profile x
refused 78 "prismsim: --frames: /nowhere.json: cannot be read: No such file or directory" --out x.pcap --frames /nowhere.json
refused 1 "prismsim: /nowhere/x.pcap: cannot be written: No such file or directory" --out /nowhere/x.pcap
refused 1 "prismsim: $dir/a.csv: exists but is not a symbolic link; expected a free name" --link "$dir/a.csv"
if [ -w /dev/full ]; then
  refused 1 "prismsim: /dev/full: is a device, expected a regular file" --hours 0.1 --out /dev/full
fi
