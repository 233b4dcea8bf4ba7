# SPDX-License-Identifier: MIT
# A log of 1800 rows, changed by each line of the page, a script of sed: what verify lists, and what a training uses of it. Then two files.
log a 0.5 3 --profile fast
train() { prismcal train bad --method ls --inputs T --window 25 --end-mean 5 --force --out m.json "$@" 2>&1 || echo "exit $?"; }
both() {
  { prismcal verify bad 2>&1 || true; } | head -8
  train "$@" | grep -E '^(bad|prismcal|  T |  residual|exit)' || true
}
mkdir bad
while read -r script; do
  echo "== $script" && rm -f bad/*
  sed -E "$script" a/*.csv >bad/x.csv
  both
done <"$PAGE" | awk '/^== / {++cases} cases == 1 {usual[$0]} cases == 1 || !($0 in usual)'
capture b 0.5 4 && prismd g.json --replay b.pcap --out b >/dev/null 2>&1
two() { echo "== $*" && rm -f bad/* && cp a/*.csv bad/1.csv && sed -E "$1" b/*.csv >bad/2.csv && both "${@:2}"; }
two '/^# session/!s/2026-01-01T00/2026-01-01T01/; s/Z,17672/Z,17673/'
two '/^# axis/s/z/y/'
two '/^# axis/s/z/y/' --axis y
two '/^# gyro_serial/s/70-1/70-2/'
two '/^# site/s/34.25/34.5/'
two '/^# frames/s/second/third/'
two '15,$d'
rm bad/2.csv && cp bad/1.csv bad/3.csv && both
