# SPDX-License-Identifier: MIT
# Recordings of virtual gyros: made once a case, only those that it asks for.
# capture NAME HOURS SEED [OPTION...]: NAME.pcap, one frame a second;  log NAME ...: its log in NAME/ as well
echo '{"frames": "second-means", "clock": "device", "name": "gyro", "gyro": {"serial": "70-1"}, "site": {"latitude_deg": 34.25, "elevation_deg": 90}}' >g.json
capture() { prismsim --frames second-means --rate 1 --hours "$2" --seed "$3" --out "$1.pcap" "${@:4}" 2>/dev/null; }
log() { capture "$@"; prismd g.json --replay "$1.pcap" --out "$1" >/dev/null 2>&1; }
# show FILE...: the text of each, with its name
show() { local file; for file; do echo "== $file"; cat "$file"; echo; done; }
# lot: the logs of two recordings of each of three gyros, rec/GYRO/cycle1 and cycle2; the last is also x.pcap
lot() {
  local gyro part
  for gyro in 1 2 3; do
    sed "s/70-1/70-$gyro/" g.json >g$gyro.json
    for part in 1 2; do
      capture x 4 $((gyro * 10 + part)) --profile fast
      prismd g$gyro.json --replay x.pcap --out rec/$gyro/cycle$part >/dev/null 2>&1
    done
  done
}
