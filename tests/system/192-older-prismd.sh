# SPDX-License-Identifier: MIT
# A fake prismd of version 0.2, which ignores "protocol": 2: each client reports it in one line.
. "$(dirname "$0")/lib.sh"
PATH=$PRISM_BIN/tools/prismweb:$PRISM_BIN/tools/prismrelay:$PATH
cd "$dir"
cat >older.py <<'END'
import json, socketserver, sys
RESULTS = {"status": {"name": "gyro", "version": "0.2.0", "axis": "z", "quality": "good", "started_s": 1}, "bias": {"axis": "z", "bias_deg_per_h": 1},
           "history": [], "events": [], "subscribe": {"axes": ["z"]}, "version": {"name": "prismd", "version": "0.2.0", "protocol": 1}}
class Client(socketserver.StreamRequestHandler):
    def handle(self):
        for line in self.rfile:
            request = json.loads(line)
            answer = {"jsonrpc": "2.0", "id": request["id"], "result": RESULTS[request["method"]]}
            self.wfile.write(json.dumps(answer, separators=(",", ":")).encode() + b"\n")
class Server(socketserver.ThreadingMixIn, socketserver.UnixStreamServer):
    daemon_threads = True
Server(sys.argv[1], Client).serve_forever()
END
start older python3 older.py "$PRISM_SOCKET"
wait_for 10 test -S "$PRISM_SOCKET"
line="found a response of protocol 1, expected 2: this prismd is older; restart it"
for command in status bias history; do
  code=0; prismctl $command >out 2>err || code=$?
  same "exit code of $command" "$code" 1
  same "prismctl $command" "$(cat out err)" "prismctl: prismd: $line"
done
contains "prismctl version" "$(prismctl version)" "prismd 0.2.0"
contains "prismctl metrics" "$(prismctl metrics 2>err)" 'prism_up{gyro="gyro"} 0'
same "the error of prismctl metrics" "$(cat err)" "prismctl: gyro: prismd: $line"
PYTHONPATH=$PRISM_SOURCE/clients/python PYTHONDONTWRITEBYTECODE=1 python3 -c '
import prism
try:
    prism.Gyro().bias()
except prism.PrismError as why:
    print(why)' >python.out
same "the Python client" "$(cat python.out)" "$line"
echo "{\"site\": \"lab\", \"instances\": \"$PRISM_SOCKET\", \"status_file\": \"$dir/relay.json\", \"metrics\": {\"file\": \"$dir/relay.prom\"}}" >relay.conf
start relay prismrelay relay.conf
export XDG_RUNTIME_DIR=$dir
start_web
sleep 4  # several attempts
same "lines of prismrelay" "$(grep -c "gone: $line" relay.err)" 1
same "lines of prismweb" "$(grep -c "prismweb: gyro: prismd: $line" web.err)" 1
