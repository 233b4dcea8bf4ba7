# SPDX-License-Identifier: MIT
# Logs and captures with damage: what verify lists, and what an evaluation leaves out.
log a 3 3 --profile fast
prismcal train a --method ls --inputs T --out m.json --force --quiet >/dev/null
prismcal verify a a.pcap --json
cp -r a bad
file=$(ls bad/*.csv | head -1)
sed -i -e '2001s/,/;/' -e '3001,3006d' -e '4001s/.$/x/' -e '5001s/^/7/' "$file"
head -c 200000 a.pcap >cut.pcap
head -c -700 "$file" >bad/last.csv && rm "$file"
cp a.pcap changed.pcap && printf 'xx' | dd of=changed.pcap bs=1 seek=100000 conv=notrunc 2>/dev/null
prismcal verify bad cut.pcap changed.pcap || echo "exit $?"
prismcal evaluate m.json bad --in-sample || echo "exit $?"
prismcal inspect cut.pcap || echo "exit $?"
prismcal allan bad
