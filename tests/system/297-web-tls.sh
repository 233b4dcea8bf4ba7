# SPDX-License-Identifier: MIT
# TLS of prismweb: offered ciphers, rejected keys, and warnings about the validity of a certificate.
. "$(dirname "$0")/lib.sh"
PATH=$PRISM_BIN/tools/prismweb:$PATH
cd "$dir"
export XDG_RUNTIME_DIR=$dir
umask 077
# certificate NAME ALGORITHM [OPTIONS OF x509]: writes NAME.key and the self-signed NAME.crt.
certificate() {
  local name=$1 algorithm=$2
  openssl genpkey -algorithm $algorithm -out "$name.key" 2>/dev/null
  openssl req -new -key "$name.key" -subj /CN=localhost -out "$name.csr" 2>/dev/null
  openssl x509 -req -in "$name.csr" -signkey "$name.key" -out "$name.crt" "${@:3}" 2>/dev/null
}
certificate rsa "RSA -pkeyopt rsa_keygen_bits:2048" -days 400
certificate ec "EC -pkeyopt ec_paramgen_curve:P-256" -days 400
certificate soon "EC -pkeyopt ec_paramgen_curve:P-256" -days 12
tls_config() { echo "{\"listen\": \"127.0.0.1:0\", \"instances\": \"$dir/none.sock\", \"state\": \"\", \"tls\": {\"certificate\": \"$1.crt\", \"key\": \"${2:-$1}.key\"}}" >web.json; }
# check: prints exit code and output of --check. It has no terminal: it must not wait for the passphrase of an encrypted key.
check() { code=0; out=$(timeout 10 setsid prismweb --config web.json --check 2>&1 </dev/null) || code=$?; echo "$code $out"; }

for name in rsa ec; do
  tls_config $name
  start web prismweb --config web.json
  wait_for 10 grep -q https: web.out
  port=$(sed 's|.*:\([0-9]*\)/.*|\1|' web.out)
  # handshake OPTIONS...: prints the agreed cipher, or "refused".
  handshake() { openssl s_client -connect "127.0.0.1:$port" "$@" </dev/null 2>/dev/null | sed -n 's/^ *Cipher *: \([^0].*\)/\1/p; s/^New, .*Cipher is \(.*\)/\1/p' | grep -v NONE | head -1 | grep . || echo refused; }
  authentication=$([ $name = rsa ] && echo RSA || echo ECDSA)
  contains "$name: TLS 1.3" "$(handshake -tls1_3)" TLS_
  for cipher in ECDHE-$authentication-AES256-GCM-SHA384 ECDHE-$authentication-AES128-GCM-SHA256 ECDHE-$authentication-CHACHA20-POLY1305; do
    same "$name: TLS 1.2" "$(handshake -tls1_2 -cipher $cipher)" $cipher
  done
  for cipher in AES256-SHA AES128-SHA AES128-GCM-SHA256 AES256-SHA256 ECDHE-$authentication-AES128-SHA ECDHE-$authentication-AES256-SHA384; do
    same "$name: TLS 1.2" "$(handshake -tls1_2 -cipher $cipher:@SECLEVEL=0)" refused
  done
  same "$name: TLS 1.1" "$(handshake -tls1_1 -cipher ALL:@SECLEVEL=0)" refused
  contains "HSTS" "$(curl -skI "https://127.0.0.1:$port/")" "Strict-Transport-Security: max-age=31536000"
  [ ! -s web.err ] || fail "a valid certificate: found '$(cat web.err)', expected no message"
  kill -TERM "$pid"; wait "$pid" || fail "exit code $?"
done

# Keys.
tls_config ec
chmod 644 ec.key
same "a key that others may read" "$(check)" "78 prismweb: $dir/ec.key: accessible to other users, expected mode 0640 or stricter"
chmod 640 ec.key
contains "a key of the group" "$(check)" "0 prismweb: good"
openssl pkey -in ec.key -aes256 -passout pass:secret -out locked.key
tls_config ec locked
same "an encrypted key" "$(check)" "78 prismweb: $dir/locked.key: is encrypted, expected a key without a passphrase, as \"openssl pkey\" writes it"
tls_config ec soon
contains "the key of another certificate" "$(check)" "78 prismweb: $dir/soon.key: "
tls_config rsa ec
same "a key of another type" "$(check)" "78 prismweb: $dir/ec.key: is not the key of $dir/rsa.crt"

# Validity.
tls_config soon
contains "a certificate that expires soon" "$(check)" "prismweb: warning: $dir/soon.crt: expires on "
mkdir ca && touch ca/index && echo 01 >ca/serial
printf '[ca]\ndefault_ca=own\n[own]\ndatabase=ca/index\nserial=ca/serial\nnew_certs_dir=ca\ndefault_md=sha256\nunique_subject=no\npolicy=any\n[any]\ncommonName=supplied\n' >ca.cnf
# valid NAME FROM TO: writes a certificate for ec.key with this validity period.
valid() { openssl ca -config ca.cnf -batch -selfsign -keyfile ec.key -in ec.csr -startdate "$(date -u -d "$2" +%Y%m%d%H%M%SZ)" -enddate "$(date -u -d "$3" +%Y%m%d%H%M%SZ)" -out "$1.crt" -notext 2>/dev/null; }
valid expired '-90 days' '-3 days'
tls_config expired ec
contains "an expired certificate" "$(check)" "prismweb: warning: $dir/expired.crt: expired on "
valid early '+5 days' '+90 days'
tls_config early ec
contains "a certificate that is not valid yet" "$(check)" "prismweb: warning: $dir/early.crt: is not valid before "
