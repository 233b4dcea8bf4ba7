# SPDX-License-Identifier: MIT
# The address that prismweb prints works once and gives a cookie. Tests which requests the cookie authenticates, and the separate
# token for programs.
. "$(dirname "$0")/lib.sh"
needs_websockets
start_at() {
  : >web.out
  start web prismweb --listen "127.0.0.1:$1" --state "" --instance "$dir/none.sock"
  web=$pid
  wait_for 10 grep -q token= web.out
  port=$(sed 's|.*:\([0-9]*\)/.*|\1|' web.out)
  origin=http://127.0.0.1:$port
  once=$(sed 's/.*#token=//' web.out)
}
start_at 0
# browser NAME PATH [OPTIONS]: prints the response status for a page of prismweb in a browser with the cookie jar NAME.
browser() { local jar=$1 path=$2; shift 2; curl -s -o answer -D head -w '%{http_code}' -b "$jar" -c "$jar" -H "Origin: $origin" -H "Sec-Fetch-Site: same-origin" "$@" "$origin$path"; }
opens() { browser "$1" /session -X POST -H "Authorization: Bearer $2"; }
program() { curl -s -o /dev/null -w '%{http_code}' -H "Authorization: Bearer $1" "$origin/api/instances"; }

same "the token of the address, used by a program" "$(program "$once")" 401
same "the token of the file, used by a program" "$(program "$(program_token)")" 200
same "mode of the token file" "$(stat -c %a "prismweb-$port.token")" 600
same "no cookie" "$(browser first /api/instances)" 401
same "the token for programs at /session" "$(opens first "$(program_token)")" 204
same "cookies set by it" "$(grep -ci set-cookie head || true)" 0
same "a GET" "$(browser first /session)" 405
same "another site" "$(curl -s -o /dev/null -w '%{http_code}' -X POST -H 'Origin: http://evil.example' -H "Authorization: Bearer $once" "$origin/session")" 403
same "the address" "$(opens first "$once")" 204
contains "its cookie" "$(tr -d '\r' <head)" "; Path=/; HttpOnly; SameSite=Strict; Max-Age=2592000"
contains "its cookie" "$(cat head)" "Set-Cookie: prism-$port="
same "the cookie, used as the token" "$(program "$(awk -v name="prism-$port" '$6 == name {print $7}' first)")" 401
same "the address again in the same browser" "$(opens first "$once")" 204
same "the address in a second browser" "$(opens second "$once")" 401
same "the second browser, without a cookie" "$(browser second /api/instances)" 401
same "the first browser, with its cookie" "$(browser first /api/instances)" 200
same "/metrics with a cookie" "$(browser first /metrics)" 200

# A browser also sends the cookie with requests of pages on other ports of this host.
cookie="Cookie: prism-$port=$(awk -v name="prism-$port" '$6 == name {print $7}' first)"
foreign() { curl -s -o /dev/null -w '%{http_code}' -H "$cookie" "$@" "$origin/api/instances"; }
same "a page of another port" "$(foreign -H 'Origin: http://127.0.0.1:1')" 401
same "without an Origin" "$(foreign -H 'Sec-Fetch-Site: same-site')" 401
same "another site, without an Origin" "$(foreign -H 'Sec-Fetch-Site: cross-site')" 401
same "a request without Origin and Sec-Fetch-Site" "$(foreign)" 401
same "an address typed by the user" "$(foreign -H 'Sec-Fetch-Site: none')" 200
cat >hello.py <<'END'
import asyncio, json, sys, websockets
from websockets.legacy.client import connect

async def main(url, origin, cookie, token):
    """Prints `ready` of the first response, or the code with which the WebSocket was closed."""
    try:
        async with connect(url, origin=origin, extra_headers={"Cookie": cookie}) as socket:
            await socket.send(json.dumps({"token": token}))
            print(json.loads(await socket.recv())["ready"])
    except websockets.ConnectionClosed as end:
        print(end.code)

asyncio.run(main(*sys.argv[1:]))
END
hello() { "$python" hello.py "ws://127.0.0.1:$port/ws" "$1" "${cookie#Cookie: }" "${2:-}"; }
same "the WebSocket of the page" "$(hello "$origin")" True
same "the WebSocket of another port's page" "$(hello http://127.0.0.1:1)" 1008
same "a wrong token in addition to the cookie" "$(hello "$origin" wrong)" 1008
same "the token of the address in the WebSocket" "$("$python" "$PRISM_SOURCE/tests/system/web_client.py" "ws://127.0.0.1:$port/ws" "$once" hello)" "closed 1008"
same "the token for programs in the WebSocket" "$("$python" "$PRISM_SOURCE/tests/system/web_client.py" "ws://127.0.0.1:$port/ws" "$(program_token)" hello | jq .ready)" true

# A reload prints a new address only if the last one was used; a restart always does. Cookie and token survive both.
kill -HUP "$web"
addresses() { [ "$(grep -c token= web.out)" = "$1" ]; }
wait_for 5 addresses 2
second=$(sed -n '2s/.*#token=//p' web.out)
[ "$second" != "$once" ] || fail "the used address was printed again"
kill -HUP "$web"
reloaded() { [ "$(grep -c reloaded web.err)" = "$1" ]; }
wait_for 5 reloaded 2
same "addresses after a reload with the second one unused" "$(grep -c token= web.out)" 2
token=$(program_token)
kill -TERM "$web"; wait "$web" || fail "exit code $?"
start_at "$port"
same "the cookie after a restart" "$(browser first /api/instances)" 200
same "the program's token after a restart" "$(program "$token")" 200
same "the address from before the restart" "$(opens second "$second")" 401
same "the new address" "$(opens second "$once")" 204
kill -TERM "$web"; wait "$web" || fail "exit code $?"
rm "prismweb-$port.token"
start_at "$port"
same "a cookie after the token's file was removed" "$(browser first /api/instances)" 401
same "the program's token after its file was removed" "$(program "$token")" 401
kill -TERM "$web"; wait "$web" || fail "exit code $?"
