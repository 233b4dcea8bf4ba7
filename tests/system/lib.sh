# SPDX-License-Identifier: MIT
# Shared by the system tests: a temporary directory, the programs, waiting for a condition, checks, cleanup.
# Each test is a script that sources this file. ctest sets PRISM_BIN (directory of the programs) and PRISM_SOURCE.
set -euo pipefail
: "${PRISM_BIN:?set by ctest}" "${PRISM_SOURCE:?set by ctest}"
for program in daemon tools/prismctl tools/prismsim tools/prismcal tools/prismweb tools/prismrelay; do PATH=$PRISM_BIN/$program:$PATH; done
dir=$(mktemp -d "${TMPDIR:-/tmp}/prism-test.XXXXXX")
cd "$dir"
export PRISM_SOCKET=$dir/gyro.sock XDG_RUNTIME_DIR=$dir
export PRISM_TIME_SCALE=10  # programs divide their own waits by this (base/time_scale.hpp); a test may set another value
children=()
undo=()  # at_exit COMMAND: adds a cleanup command. A trap of the test would lose the exit code.
at_exit() { undo+=("$1"); }
cleanup() {
  code=$?
  if [ "$code" -ne 0 ] && [ "$code" -ne 77 ]; then
    for file in "$dir"/*.err; do [ -f "$file" ] && sed "s|^|$(basename "$file"): |" "$file" | tail -20; done
  fi
  [ ${#children[@]} -eq 0 ] || kill -9 "${children[@]}" 2>/dev/null || true
  wait 2>/dev/null || true
  for command in "${undo[@]}"; do "$command" || true; done
  rm -rf "$dir"
  exit "$code"
}
trap cleanup EXIT

fail() { echo "FAILED: $*" >&2; exit 1; }
skip() { echo "skipped: $*"; exit 77; }

# wait_for SECONDS COMMAND...: repeats the command until it succeeds. SECONDS is enough on an idle machine; the test fails a minute
# later, so that no test fails because a machine is slow.
wait_for() {
  local deadline=$((SECONDS + $1 + 60)); shift
  until "$@" >/dev/null 2>&1; do
    [ "$SECONDS" -lt "$deadline" ] || fail "timed out: $*"
    sleep 0.02
  done
}

# free_port: prints a port of TCP that nothing uses.
free_port() { python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }

# same WHAT FOUND EXPECTED / contains WHAT TEXT PART
same() { [ "$2" = "$3" ] || fail "$1: found '$2', expected '$3'"; }
contains() { case "$2" in *"$3"*) ;; *) fail "$1: found '$2', expected it to contain '$3'" ;; esac; }

# start NAME COMMAND...: runs the command in the background, with output to NAME.out and NAME.err; sets $pid.
start() {
  local name=$1; shift
  "$@" >"$dir/$name.out" 2>>"$dir/$name.err" &
  pid=$!
  children+=("$pid")
}

# frames HZ: writes frames.json, trplg at another nominal rate, for the virtual gyro and prismd. Device time counts frames.
frames() { sed "s/\"rate_hz\": 200/\"rate_hz\": $1/" "$PRISM_SOURCE/config/frames/trplg.json" >"$dir/frames.json"; }
frames 200

# start_sim [OPTIONS]: starts a virtual gyro on $dir/tty.
start_sim() { start sim prismsim --link "$dir/tty" --frames "$dir/frames.json" "$@"; sim=$pid; wait_for 5 test -e "$dir/tty"; }

# config [MEMBERS]: writes $dir/gyro.json for the virtual gyro, with the device clock; it may run faster than real time.
config() {
  cat >"$dir/gyro.json" <<END
{"line": {"device": "$dir/tty", "silence_s": 1, "retry_min_s": 0.05, "retry_max_s": 0.2},
 "frames": "$dir/frames.json", "clock": "device", "accept_clock": true,
 "model": "$PRISM_SOURCE/config/models/tao2019-model2.json",
 "log": {"directory": "$dir/log"}, "socket": {"path": "$PRISM_SOCKET"}${1:+, $1}}
END
}
# start_hostile NAME [unreadable]: starts a fake prismd on $dir/NAME.sock with hostile texts in every field.
start_hostile() { start "$1" python3 "$PRISM_SOURCE/tests/system/hostile_prismd.py" "$dir/$1.sock" "${2:-rows}"; wait_for 10 test -S "$dir/$1.sock"; }
# is_printable FILE...: succeeds for valid UTF-8 without control characters (except line feed) and bidirectional formatting.
is_printable() { ! LC_ALL=C grep -aqP '[\x00-\x09\x0b-\x1f\x7f]|\xc2[\x80-\x9f]|\xe2\x80[\xaa-\xae]' "$@" && cat "$@" | iconv -f UTF-8 -t UTF-8 >/dev/null 2>&1; }
# Logs without the lines in which a replay may differ from the live log.
log_text() { grep -hv '^# \(log\|end\): ' "$@"; }
start_prismd() { start prismd prismd "$dir/gyro.json" "$@"; prismd=$pid; wait_for 5 prismctl version; }

# needs_websockets: sets $python to one with python3-websockets, an independent client, or skips the test.
needs_websockets() {
  for python in /usr/bin/python3 python3; do ! "$python" -c 'import websockets' 2>/dev/null || return 0; done
  skip "python3-websockets is not installed (run tools/setup)"
}

# start_web [MEMBERS]: starts a prismweb for the virtual gyro's prismd, with MEMBERS in its configuration, and stores minutes in
# $web_state if set. Sets $web (pid), $url and $token (for programs); the URL of the page is in web.out.
start_web() {
  echo "{\"listen\": \"127.0.0.1:0\", \"instances\": \"$PRISM_SOCKET\", \"state\": \"${web_state:-}\"${1:+, $1}}" >"$dir/web.json"
  : >"$dir/web.out"
  start web prismweb --config "$dir/web.json"
  web=$pid
  wait_for 5 grep -q token= "$dir/web.out"
  url=$(sed 's/#.*//' "$dir/web.out")
  token=$(program_token)
}
# program_token [FILE]: prints the token for programs of the prismweb whose URL is in FILE (default: web.out).
program_token() { cat "$XDG_RUNTIME_DIR/prismweb-$(sed 's|.*:\([0-9]*\)/.*|\1|;q' "${1:-$dir/web.out}").token"; }

# ask METHOD [PARAMS]: prints the raw response. field FILTER METHOD: prints one value of prismctl's JSON.
ask() { printf '{"jsonrpc":"2.0","id":1,"protocol":2,"method":"%s","params":%s}\n' "$1" "${2:-null}" | timeout 60 socat -t 30 - "UNIX-CONNECT:$PRISM_SOCKET"; }
# first_answer REQUESTS: prints the first response. The connection stays open: prismd sends no later response to a client that closed its half.
first_answer() { python3 -c 'import socket, sys; s = socket.socket(socket.AF_UNIX); s.connect(sys.argv[1]); s.sendall(sys.argv[2].encode() + b"\n"); print(s.makefile().readline())' "$PRISM_SOCKET" "$1"; }
field() { prismctl --json "$2" | jq -r "$1"; }
field_is() { [ "$(field "$1" "$2")" = "$3" ]; }
field_above() { [ "$(field "$1 > $3" "$2")" = true ]; }
