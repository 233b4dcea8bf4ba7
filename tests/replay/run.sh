# SPDX-License-Identifier: MIT
# Replay goldens: NAME.pcap through prismd with NAME.json gives NAME.expected, byte for byte.
# PRISM_REGENERATE=1 rewrites the expected logs; read the diff as code.
. "$(dirname "$0")/../system/lib.sh"
name=$1
captures=$PRISM_SOURCE/tests/replay/captures
prismd "$captures/$name.json" --replay "$captures/$name.pcap" --out "$dir/log" >"$dir/summary" 2>"$dir/prismd.err" || fail "exit code $?"
cat "$dir"/log/*.csv | sed 's/^# prism [^ ]*/# prism VERSION/; s/^# log: [0-9a-f]*/# log: ID/; s/^\(# end: .*sha256\) .*/\1 SUM/' >"$dir/found"
if [ -n "${PRISM_REGENERATE:-}" ]; then cp "$dir/found" "$captures/$name.expected"; fi
diff -u "$captures/$name.expected" "$dir/found" >"$dir/diff" || { head -40 "$dir/diff"; fail "$name: the log differs from $name.expected"; }
