# SPDX-License-Identifier: MIT
# Every invalid request gets its JSON-RPC error, and later requests still work.
. "$(dirname "$0")/lib.sh"
config
start_prismd
send() { printf '%s\n' "$1" | timeout 60 socat -t 30 - "UNIX-CONNECT:$PRISM_SOCKET"; }
code_of() { send "$1" | jq -c '.error.code // "none"' | head -1; }
same "invalid JSON" "$(code_of 'hello')" -32700
same "not a request" "$(code_of '42')" -32600
same "no version" "$(code_of '{"id":1,"method":"status"}')" -32600
same "method of a wrong type" "$(code_of '{"jsonrpc":"2.0","id":1,"method":7}')" -32600
same "unknown method" "$(code_of '{"jsonrpc":"2.0","id":1,"method":"launch"}')" -32601
same "bad params" "$(code_of '{"jsonrpc":"2.0","id":1,"protocol":2,"method":"history","params":{"seconds":0}}')" -32602
same "bad stream" "$(code_of '{"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"streams":["x"]}}')" -32602
same "empty batch" "$(code_of '[]')" -32600
same "batch" "$(send '[{"jsonrpc":"2.0","id":1,"method":"version"},{"jsonrpc":"2.0","id":2,"method":"version"}]' | wc -l)" 2
same "notification" "$(send '{"jsonrpc":"2.0","method":"status"}' | wc -c)" 0
same "invalid UTF-8" "$(printf '{"jsonrpc":"2.0","id":1,"method":"\xff\xfe"}\n' | timeout 60 socat -t 30 - "UNIX-CONNECT:$PRISM_SOCKET" | jq -c .error.code)" -32700
# Not more bytes than prismd reads before it closes the connection: else the client may miss the response.
long=$(head -c 65537 /dev/zero | tr '\0' 'x' | timeout 60 socat -t 30 - "UNIX-CONNECT:$PRISM_SOCKET" 2>/dev/null | jq -c .error.code || true)
same "a line that is too long" "$long" -32600
head -c 200000 /dev/urandom | timeout 60 socat -u - "UNIX-CONNECT:$PRISM_SOCKET" 2>/dev/null || true
same "a request after random bytes" "$(ask version | jq -r .result.name)" prismd
kill -0 "$prismd" || fail "prismd ended"
