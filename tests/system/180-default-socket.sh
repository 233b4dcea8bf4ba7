# SPDX-License-Identifier: MIT
# The second step of the README: a user runs "prismd CONFIG", and prismctl without --socket finds it.
. "$(dirname "$0")/lib.sh"
unset PRISM_SOCKET LOGS_DIRECTORY
export XDG_RUNTIME_DIR=$dir/run
mkdir -m 700 "$XDG_RUNTIME_DIR"
as_user=()
if [ "$(id -u)" -eq 0 ]; then
  unshare --user true 2>/dev/null || skip "needs a user other than root, or user namespaces"
  as_user=(unshare --user)
fi
user() { "${as_user[@]}" "$@"; }

code=0; user prismctl status 2>"$dir/e" || code=$?
same "no prismd: exit code" "$code" 1
same "no prismd" "$(cat "$dir/e")" \
  "prismctl: /run/prismd, $dir/run/prismd: no prismd answers here; start one, or name its socket with --socket"

sed "s|/tmp/tty|$dir/tty|; s|/tmp/prism-log|$dir/log|" "$PRISM_SOURCE/config/prismd.json" >"$dir/bench.json"
start_sim --profile steady
start prismd "${as_user[@]}" prismd "$dir/bench.json"
wait_for 5 user prismctl status
contains "the only instance" "$(user prismctl status)" "instance     bench"
[ -S "$dir/run/prismd/bench.sock" ] || fail "the socket is not in XDG_RUNTIME_DIR"

cp "$dir/bench.json" "$dir/other.json"
sed -i "s|$dir/log|$dir/log2|" "$dir/other.json"
start other "${as_user[@]}" prismd "$dir/other.json" --device "$dir/none"
wait_for 5 user prismctl --name other status
code=0; user prismctl status 2>"$dir/e" || code=$?
same "two instances: exit code" "$code" 1
same "two instances" "$(cat "$dir/e")" "prismctl: --name: required if several instances run; choose one of: bench, other"
code=0; user prismctl --name othre status 2>"$dir/e" || code=$?
same "a mistyped name" "$(cat "$dir/e")" "prismctl: --name: found \"othre\", did you mean \"other\"? Running: bench, other"

# The error for an unknown command contains its name.
code=0; prismctl --name bench stauts 2>"$dir/e" || code=$?
same "a mistyped command: exit code" "$code" 64
same "a mistyped command" "$(cat "$dir/e")" 'prismctl: found the command "stauts", did you mean "status"?'
code=0; prismctl 2>"$dir/e" || code=$?
same "no command" "$(cat "$dir/e")" "prismctl: A subcommand is required; see prismctl --help"
