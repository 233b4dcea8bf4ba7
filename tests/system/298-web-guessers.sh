# SPDX-License-Identifier: MIT
# While 100 addresses of this host guess passwords of prismweb, clients at new addresses with the right password log in within 3 s.
. "$(dirname "$0")/lib.sh"
PATH=$PRISM_BIN/tools/prismweb:$PATH
cd "$dir"
export XDG_RUNTIME_DIR=$dir
umask 077
openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -keyout web.key -out web.crt -days 90 -subj /CN=localhost 2>/dev/null
for i in 1 2 3 4 5 6; do echo "user$i:$(echo "secret$i" | prismweb --hash-password)" >>web.passwords; done
echo "{\"listen\": \"127.0.0.1:0\", \"instances\": \"$dir/none.sock\", \"state\": \"\", \"tls\": {\"certificate\": \"web.crt\", \"key\": \"web.key\"}, \"passwords\": \"web.passwords\"}" >web.json
start web prismweb --config web.json
web=$pid
wait_for 10 grep -q https: web.out
port=$(sed 's|.*:\([0-9]*\)/.*|\1|' web.out)
cat >guess.py <<'END'
import asyncio, base64, collections, ssl, sys, time

port, GUESSERS, LIMIT = int(sys.argv[1]), 100, 6000
plain = ssl._create_unverified_context()
answers, guesses, right_s = collections.Counter(), 0, []

async def login(address, name, password):
    """Returns the response status for a client at this address of the loopback interface."""
    code = base64.b64encode(f"{name}:{password}".encode()).decode()
    reader, writer = await asyncio.open_connection("127.0.0.1", port, ssl=plain, local_addr=(address, 0))
    try:
        writer.write(f"GET /api/instances HTTP/1.1\r\nHost: localhost\r\nAuthorization: Basic {code}\r\nConnection: close\r\n\r\n".encode())
        return int((await reader.readline()).split()[1])
    finally:
        writer.close()

async def guess(i, until):
    """Guesses wrong passwords until `until`, or until all guessers together made LIMIT guesses. Two run at once per address."""
    global guesses
    while time.monotonic() < until and guesses < LIMIT:
        guesses += 1
        try:
            answers[await asyncio.wait_for(login(f"127.0.0.{i + 2}", f"user{1 + guesses % 6}", f"wrong{guesses}"), 15)] += 1
        except (OSError, IndexError, asyncio.TimeoutError) as error:
            answers[type(error).__name__] += 1
        await asyncio.sleep(0.5)

async def main():
    until = time.monotonic() + 40
    guessers = [asyncio.create_task(guess(i, until)) for i in range(GUESSERS) for _ in range(2)]
    await asyncio.sleep(3)
    for i in range(6):
        begin = time.monotonic()
        status = await login(f"127.0.1.{i + 1}", f"user{i + 1}", f"secret{i + 1}")
        print(f"client {i + 1}: {status} after {time.monotonic() - begin:.2f} s, {guesses} guesses", flush=True)
        right_s.append((status, time.monotonic() - begin))
        await asyncio.sleep(4)
    for task in guessers:
        task.cancel()
    print("responses to the guessers:", dict(answers))
    assert all(status == 200 and seconds < 3 for status, seconds in right_s), right_s
    assert answers[200] == 0 and 2 * GUESSERS <= guesses < LIMIT, (answers, guesses)

asyncio.run(main())
END
python3 guess.py "$port" || fail "a client with the right password was not admitted within 3 s"
[ "$(awk '/^VmHWM/{print $2}' "/proc/$web/status")" -lt 65536 ] || fail "prismweb used $(grep VmHWM "/proc/$web/status"), expected less than 64 MiB"
kill -TERM "$web"; wait "$web" || fail "exit code $?"
