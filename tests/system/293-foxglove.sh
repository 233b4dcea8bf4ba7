# SPDX-License-Identifier: MIT
# /foxglove of prismweb, byte for byte: authentication, valid and invalid requests, every sample at 1000 frames/s, a client that does
# not read, and an instance that starts later.
. "$(dirname "$0")/lib.sh"
PATH=$PRISM_BIN/tools/prismweb:$PATH
needs_websockets
cd "$dir"
export XDG_RUNTIME_DIR=$dir
frames 1000
config
client() { local url=$1; shift; "$python" "$PRISM_SOURCE/tests/system/foxglove_client.py" "$url" "$@"; }

# Off unless configured; the instance does not run yet.
start_web
url=$(foxglove_url)
same "without the key foxglove" "$(client "$url" refused)" 404
kill "$pid"; wait "$pid"

start_web '"foxglove": {"origins": ["https://app.foxglove.dev", "file://"]}'
url=$(foxglove_url)
same "the older name" "$(client "$url" refused)" foxglove.websocket.v1
same "the newer name" "$(client "$url" refused protocol=foxglove.sdk.v1)" foxglove.sdk.v1
same "another protocol" "$(client "$url" refused protocol=foxglove.websocket.v9)" 400
same "no protocol" "$(client "$url" refused protocol=)" 400
same "a wrong token" "$(client "${url}0" refused)" 401
same "no token" "$(client "${url%\?*}" refused)" 401
same "the token as a header" "$(client "${url%\?*}" refused "Authorization=Bearer ${url#*=}")" foxglove.websocket.v1
same "a page of Foxglove" "$(client "$url" refused Origin=https://app.foxglove.dev)" foxglove.websocket.v1
same "the program of Foxglove" "$(client "$url" refused Origin=file://)" foxglove.websocket.v1
same "a page of another site" "$(client "$url" refused Origin=https://app.foxglove.dev.evil.example)" 403
same "a page of Foxglove at /ws" "$(client "${url/foxglove/ws}" refused Origin=https://app.foxglove.dev)" 403
same "the protocol of the page's WebSocket" "$(client "${url%/foxglove*}/ws" refused)" None
same "another path" "$(client "${url/foxglove/foxgloves}" refused)" 404

# Connected clients are notified of new and removed topics, and can subscribe again to a topic that returns.
start looking client "$url" axes
looking=$pid
wait_for 10 grep -q ready looking.out
start_sim --profile steady --hours 1
data_of() { [ "$(grep -c "^data $1" looking.out)" -ge "$2" ]; }
axis() {
  [ -z "${prismd:-}" ] || { kill -9 "$prismd"; wait "$prismd" 2>/dev/null || true; }
  sed -i "s/\"axes\": {\"[a-z]*\"/\"axes\": {\"$1\"/" frames.json
  start_prismd
  wait_for 10 data_of "$1" "$2"
}
axis z 1
axis x 1
axis z 2
kill "$looking"
same "new and removed topics" "$(tr '\n' '|' <looking.out)" "ready /gyro/event|advertise /gyro/z/sample /gyro/z/window|data z|unadvertise /gyro/z/sample /gyro/z/window|\
advertise /gyro/x/sample /gyro/x/window|data x|unadvertise /gyro/x/sample /gyro/x/window|advertise /gyro/z/sample /gyro/z/window|data z|"

start deaf client "$url" deaf 20
deaf=$pid
same "valid and invalid requests" "$(client "$url" talk)" good
start windows client "$url" count 6 window
windows=$pid
same "every sample of 6 s" "$(client "$url" count 6 sample | jq -c '[.messages > 5000 and .messages < 6500, .holes, .backward]')" '[true,0,0]'
wait "$windows"
same "windows of 6 s" "$(jq -c '[.messages >= 4 and .messages <= 7, .holes, .backward]' windows.out)" '[true,0,0]'
wait "$deaf"
contains "the client that did not read" "$(cat deaf.out)" "gyro: "
