# SPDX-License-Identifier: MIT
# Foxglove's client library (npm package @foxglove/ws-protocol) with prismweb and a virtual gyro: it gets all topics, each message
# matches its schema, and data continue after a restart of prismd. Tested with both names of the protocol.
. "$(dirname "$0")/lib.sh"
PATH=$PRISM_BIN/tools/prismweb:$PATH
for program in node npm; do command -v $program >/dev/null || skip "$program is not installed (Debian packages nodejs and npm)"; done
cd "$dir"
mkdir client && cp "$PRISM_SOURCE"/tests/foxglove/* client/
# If the registry does not respond, npm waits for minutes and ignores SIGTERM.
(cd client && timeout -k 5 60 npm ci --prefer-offline --silent --no-audit --no-fund) >npm.out 2>&1 || skip "npm ci failed, perhaps without access to the registry: $(grep -m1 . npm.out || true)"
frames 100
config
start_sim --profile steady
start_prismd
export XDG_RUNTIME_DIR=$dir
start_web '"foxglove": {}'
url=$(foxglove_url)
of() { jq -c ".topics[\"/gyro/z/$1\"] | $2" $3.json; }

for protocol in foxglove.websocket.v1 foxglove.sdk.v1; do
  node client/client.mjs "$url" $protocol 5 /gyro/z/window /gyro/z/sample /gyro/event >$protocol.json
  same "the protocol" "$(jq -r .protocol $protocol.json)" $protocol
  same "the server" "$(jq -c '[.server.capabilities, .errors, .status]' $protocol.json)" '[[],[],[]]'
  same "the topics" "$(jq -c '.advertised | sort' $protocol.json)" '["/gyro/event","/gyro/z/sample","/gyro/z/window"]'
  for stream in window sample; do
    same "$stream: order, schema and times" "$(of $stream '[.unlike_schema, .backward, .unlike_time]' $protocol)" '[0,0,0]'
  done
  same "windows of 5 s" "$(of window '.messages >= 3 and .messages <= 6' $protocol)" true
  same "samples of 5 s" "$(of sample '.messages > 350 and .messages < 600' $protocol)" true
  same "the rate" "$(of window '.first.rate_deg_per_h | . > 6 and . < 12' $protocol)" true
  same "a window contains the unknown slope" "$(of window '.first | has("slope_degc_per_s")' $protocol)" false
done

start watching node client/client.mjs "$url" foxglove.websocket.v1 9 /gyro/z/window /gyro/event
watching=$pid
sleep 3
kill -9 "$prismd"; wait "$prismd" 2>/dev/null || true
start_prismd
sleep 3
kill -9 "$sim"; wait "$sim" 2>/dev/null || true  # causes an event: the line is lost
wait "$watching"
mv watching.out watching.json
same "windows before and after the restart" "$(of window '.messages >= 4 and .unlike_schema == 0' watching)" true
same "events" "$(jq -c '.topics["/gyro/event"] | .messages > 0 and .unlike_schema == 0' watching.json)" true

sed 's/token=.*/token=wrong/' <<<"$url" >wrong
same "a wrong token" "$(node client/client.mjs "$(cat wrong)" foxglove.websocket.v1 3 | jq -c .errors)" '["HTTP 401"]'
