# SPDX-License-Identifier: MIT
# Prints one line per check: PASS or FAIL, the check, and on failure the found and the expected value. The run continues after a
# failed check, so that it shows all effects of a fault.
passed=0
failed=0
began=$(date +%s%N)
elapsed_ms() { echo $((($(date +%s%N) - began) / 1000000)); }

pass() { passed=$((passed + 1)); echo "PASS  $1"; }
failure() { failed=$((failed + 1)); echo "FAIL  $1"; }

# check WHAT COMMAND...: passes if the command succeeds.
check() {
  local what=$1 output; shift
  if output=$("$@" 2>&1); then pass "$what"; else failure "$what: '$*' failed: $(tail -1 <<<"$output")"; fi
}

# refuse WHAT COMMAND...: passes if the command fails.
refuse() {
  local what=$1; shift
  if "$@" >/dev/null 2>&1; then failure "$what: '$*' succeeded"; else pass "$what"; fi
}

# same WHAT FOUND EXPECTED    contains WHAT TEXT PART
same() { if [ "$2" = "$3" ]; then pass "$1"; else failure "$1: found '$2', expected '$3'"; fi; }
contains() { case "$2" in *"$3"*) pass "$1" ;; *) failure "$1: found '$2', expected it to contain '$3'" ;; esac; }

# becomes SECONDS WHAT EXPECTED COMMAND...: passes if the command prints EXPECTED within the time.
becomes() {
  local deadline=$(($(date +%s%N) + $1 * 1000000000)) what=$2 expected=$3 found; shift 3
  while found=$("$@" 2>&1 || true); [ "$found" != "$expected" ]; do
    [ "$(date +%s%N)" -lt "$deadline" ] || { failure "$what: found '$found', expected '$expected'"; return 0; }
    sleep 0.05
  done
  pass "$what"
}

exit_code() { "$@" >/dev/null 2>&1; echo $?; }

# Prints the totals; succeeds if at least one check passed and no check failed.
verdict() {
  echo "$passed passed, $failed failed, $(elapsed_ms) ms"
  [ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
}
