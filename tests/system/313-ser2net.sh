# SPDX-License-Identifier: MIT
# A device server of Debian's packages between the virtual gyro and prismd: ser2net and gensiot, as docs/lines.md shows them; ser2net also with several
# programs on one line.
. "$(dirname "$0")/lib.sh"
PATH=$PATH:/usr/sbin
command -v ser2net >/dev/null && command -v gensiot >/dev/null || skip "no ser2net or gensio-bin (tools/setup all)"
frames 50
start_sim --profile steady
through() { # NAME PORT: prismd receives the complete stream through this server
  cat >"$dir/gyro.json" <<END
{"line": {"tcp": {"address": "127.0.0.1:$2"}, "silence_s": 1}, "frames": "$dir/frames.json", "clock": "device", "write_log": false,
 "socket": {"path": "$PRISM_SOCKET"}}
END
  start_prismd
  wait_for 10 field_is .state status receiving
  wait_for 5 field_above .decoder.frames line 100
  same "$1: missing frames" "$(field .timing.missing_frames line)" 0
  same "$1: rejected frames" "$(field .decoder.bad_check line)" 0
  kill -9 "$server"
  wait_for 5 field_is .state status connecting
  start "$1" "${command[@]}"; server=$pid
  wait_for 10 field_is .state status receiving
  kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"
  kill -9 "$server"; wait "$server" 2>/dev/null || true
}
# The pty of a gyro whose server ended holds frames of the time without one, and a gap behind them.
new_gyro() { kill "$sim"; wait "$sim" || fail "prismsim: exit code $?"; start_sim --profile steady; }
recipe() { # the recipe of docs/lines.md, for the gyro's pty
  awk '/^```yaml/ {on = 1; next} /^```/ {on = 0} on' "$PRISM_SOURCE/docs/lines.md" |
    sed "s|4001|$port|; s|/dev/ttyUSB0,921600|$(readlink -f "$dir/tty"),115200|" >"$dir/ser2net.yaml"
}
port=$(free_port)
recipe
grep -q max-connections "$dir/ser2net.yaml" || fail "docs/lines.md has no ser2net recipe: $(cat "$dir/ser2net.yaml")"
command=(ser2net -n -c "$dir/ser2net.yaml" -P "$dir/ser2net.pid")
start ser2net "${command[@]}"; server=$pid
through ser2net "$port"

# Several programs on one line: with prismd, two others read the same bytes, and a third one finds the description.
new_gyro
recipe
start ser2net "${command[@]}"; server=$pid
start_prismd
wait_for 10 field_is .state status receiving
socat -u "TCP:127.0.0.1:$port" "CREATE:$dir/reader1" & readers=("$!")
socat -u "TCP:127.0.0.1:$port" "CREATE:$dir/reader2" & readers+=("$!")
children+=("${readers[@]}")
long_enough() { [ "$(stat -c %s "$dir/$1")" -gt 2000 ]; }
wait_for 10 long_enough reader1
wait_for 10 long_enough reader2
contains "a sniffed line with other readers" "$(prismd --sniff "127.0.0.1:$port" "$dir/frames.json")" " fits "
kill "${readers[@]}"
for reader in reader1 reader2; do contains "the bytes of $reader" "$(prismd --sniff "$dir/$reader" "$dir/frames.json")" " fits "; done
same "missing frames with other readers" "$(field .timing.missing_frames line)" 0
kill -TERM "$prismd"; wait "$prismd" || fail "exit code $?"
kill -9 "$server"; wait "$server" 2>/dev/null || true

new_gyro
port=$(free_port)
command=(gensiot --server -a -i "serialdev,$(readlink -f "$dir/tty"),115200n81,local" "tcp,127.0.0.1,$port")
start gensiot "${command[@]}"; server=$pid
through gensiot "$port"
