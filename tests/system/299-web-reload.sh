# SPDX-License-Identifier: MIT
# On SIGHUP prismweb loads new passwords, a new certificate and its key, and closes the connections of removed users and old passwords.
# An invalid file has no effect. Also tests passwords that bcrypt would truncate.
. "$(dirname "$0")/lib.sh"
PATH=$PRISM_BIN/tools/prismweb:$PATH
needs_websockets
cd "$dir"
export XDG_RUNTIME_DIR=$dir
umask 077
new_certificate() { openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -keyout web.key -out web.crt -days 90 -subj "/CN=$1" 2>/dev/null; }
line() { echo "$1:$(echo "$2" | prismweb --hash-password)"; }
new_certificate first
hash_of_stays=$(line stays "a secret")
long=$(printf 'x%.0s' {1..72})
{ echo "$hash_of_stays"; line removed "b secret"; line changed "c secret"; line long "$long"; } >web.passwords
echo "{\"listen\": \"127.0.0.1:0\", \"instances\": \"$dir/none.sock\", \"state\": \"\", \"tls\": {\"certificate\": \"web.crt\", \"key\": \"web.key\"}, \"passwords\": \"web.passwords\"}" >web.json
start web prismweb --config web.json
web=$pid
wait_for 10 grep -q https: web.out
url=$(cat web.out)
login() { curl -sk -o /dev/null -w '%{http_code}' -u "$1" "${url}api/instances"; }
login_is() { [ "$(login "$1")" = "$2" ]; }  # repeated, because a wrong password delays the next login from this address
subject() { openssl s_client -connect "${url:8:-1}" </dev/null 2>/dev/null | sed -n 's/^subject=.*CN *= *//p'; }
cat >hold.py <<'END'
import asyncio, base64, ssl, sys, websockets

async def hold(url, login):
    """Prints "ready", then code and reason with which the WebSocket of this login is closed."""
    code = base64.b64encode(login.encode()).decode()
    async with websockets.connect(url, ssl=ssl._create_unverified_context(), extra_headers={"Authorization": f"Basic {code}"}) as socket:
        await socket.send("{}")
        await socket.recv()
        print("ready", flush=True)
        try:
            while True:
                await socket.recv()
        except websockets.ConnectionClosed as end:
            print(end.rcvd.code if end.rcvd else 1006, end.rcvd.reason if end.rcvd else "", flush=True)

asyncio.run(hold(*sys.argv[1:]))
END
for name in stays:a removed:b changed:c; do
  start "${name%:*}" "$python" hold.py "wss${url#https}ws" "${name%:*}:${name#*:} secret"
  eval "${name%:*}=$pid"
  wait_for 10 grep -q ready "${name%:*}.out"
done
same "72 bytes" "$(login "long:$long")" 200
same "more than 72 bytes" "$(login "long:${long}x")" 401
wait_for 5 login_is "stays:a secret" 200

# An invalid file.
reloads() { [ "$(grep -c reloaded web.err)" = "$1" ]; }
printf 'stays:nonsense\n' >web.passwords
kill -HUP "$web"
wait_for 5 reloads 1
same "an invalid file" "$(cat web.err)" "prismweb: not reloaded, the old files remain in use: $dir/web.passwords:1: expected NAME:HASH with a bcrypt hash (\$2b\$ or \$2y\$) of cost 4 to 15; \"prismweb --hash-password\" writes one"
same "the old password" "$(login 'removed:b secret')" 200

# A valid file.
{ echo "$hash_of_stays"; line changed "d secret"; line added "e secret"; } >web.passwords
new_certificate second
kill -HUP "$web"
reloaded() { [ "$(grep -c '^prismweb: reloaded$' web.err)" = 1 ]; }
wait_for 5 reloaded
ended() { grep -q ^1 removed.out && grep -q ^1 changed.out; }
wait_for 10 ended
for name in removed changed; do same "the WebSocket of $name" "$(tail -1 $name.out)" "1008 the password was changed or removed"; done
same "the WebSocket of the unchanged user" "$(cat stays.out)" ready
same "the certificate" "$(subject)" second
same "the unchanged user" "$(login 'stays:a secret')" 200
same "the added user" "$(login 'added:e secret')" 200
same "the new password" "$(login 'changed:d secret')" 200
same "the old password" "$(login 'changed:c secret')" 401
wait_for 5 login_is "removed:b secret" 401
kill -0 "$stays" || fail "the WebSocket of the unchanged user was closed"
code=0; printf 'a secret\0x\n' | prismweb --hash-password 2>refused || code=$?
same "a password with a NUL byte" "$code $(cat refused)" "64 prismweb: --hash-password: found a NUL byte in the password; bcrypt ignores the bytes after it"
kill -TERM "$web"; wait "$web" || fail "exit code $?"
