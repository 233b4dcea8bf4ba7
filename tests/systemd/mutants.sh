#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Checks that run.sh finds faults: each mutant is the package with one injected fault. Run it manually; half a minute per mutant.
# usage: mutants.sh PRISM.deb PRISM-TOOLS.deb PRISM-RELAY.deb PRISM-WEB.deb PROBE [MUTANT...]
# Exit code 0 if the original package passes and run.sh fails for every mutant.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d "${TMPDIR:-/tmp}/prism-mutants.XXXXXX")
trap 'rm -rf "$work"' EXIT
deb=$1 tools=$2 relay=$3 web=$4 probe=$5; shift 5
chosen=" $* "
missed=0

# mutant NAME FILE SED-EXPRESSION: FILE is a file of the package or a maintainer script (DEBIAN/...).
mutant() {
  [ "$chosen" = "  " ] || [[ $chosen == *" $1 "* ]] || return 0
  rm -rf "$work/tree"
  dpkg-deb --raw-extract "$deb" "$work/tree"
  local file=$work/tree/$2 original
  original=$(sha256sum "$file")
  sed -i -E "$3" "$file"
  [ "$1" = unharmed ] || [ "$(sha256sum "$file")" != "$original" ] || { echo "$1: no change in $2"; missed=$((missed + 1)); return 0; }
  dpkg-deb -Znone --root-owner-group --build "$work/tree" "$work/mutant.deb" >/dev/null
  local code=0 verdict=MISSED
  timeout 250 bash "$here/run.sh" "$work/mutant.deb" "$tools" "$relay" "$web" "$probe" >"$work/log" 2>&1 || code=$?
  [ "$code" -eq 0 ] || verdict=caught
  [ "$1" != unharmed ] || { verdict=$([ "$code" -eq 0 ] && echo passes || echo MISSED); }
  [ "$code" -ne 77 ] || { cat "$work/log"; exit 77; }
  [ "$verdict" != MISSED ] || missed=$((missed + 1))
  echo "$verdict $1 ($(grep -c ^FAIL "$work/log" || true)): $(grep -m1 ^FAIL "$work/log" | cut -c7-150 || tail -1 "$work/log")"
}

unit=usr/lib/systemd/system/prismd@.service
socket=usr/lib/systemd/system/prismd@.socket
mutant unharmed "$unit" ''
mutant misspelt-key "$unit" 's/^ProtectHome=/ProtectHoome=/'
mutant writable-code "$unit" '/^MemoryDenyWriteExecute/d'
mutant all-families "$unit" '/^RestrictAddressFamilies/d'
mutant all-devices "$unit" '/^(DevicePolicy|DeviceAllow|ProtectClock)/d'
mutant no-usb-serial "$unit" '/^DeviceAllow=char-188/d'
mutant all-calls "$unit" '/^SystemCallFilter/d'
mutant some-calls "$unit" 's/^(SystemCallFilter=~.*)io_uring_setup/\1/'
mutant shell "$unit" '/^(NoExecPaths|ExecPaths)/d'
mutant homes "$unit" '/^ProtectHome/d'
mutant shared-tmp "$unit" '/^(PrivateTmp|DynamicUser)/d'
mutant root "$unit" '/^(DynamicUser|User)=/d'
mutant no-dialout "$unit" '/^SupplementaryGroups/d'
mutant no-logs "$unit" '/^LogsDirectory/d'
mutant simple "$unit" 's/^Type=notify/Type=simple/'
mutant no-restart "$unit" '/^Restart=/d'
mutant restarts-for-ever "$unit" '/^RestartPreventExitStatus/d'
mutant no-watchdog "$unit" '/^WatchdogSec/d'
mutant no-reload "$unit" '/^ExecReload/d'
mutant unchecked-reload "$unit" '/^ExecReload=.*--check/d'
mutant world-socket "$socket" 's/^SocketMode=.*/SocketMode=0666/'
mutant roots-socket "$socket" '/^SocketGroup/d'
mutant socket-stays "$socket" '/^RemoveOnStop/d'
mutant no-group DEBIAN/postinst '/systemd-sysusers/d'
mutant no-try-restart DEBIAN/postinst 's/deb-systemd-invoke try-restart.*/true/'
mutant starts-all DEBIAN/postinst 's/deb-systemd-invoke try-restart.*/systemctl start prismd@gyro1 prismd@gyro2 || true/'
mutant no-stop DEBIAN/prerm 's/deb-systemd-invoke stop.*/true/'
mutant removes-configuration DEBIAN/postrm 's/= purge/= remove/'
mutant keeps-logs DEBIAN/postrm 's|(for folder in /var/lib) /var/log|\1|'
mutant keeps-configuration DEBIAN/postrm '/rm -rf.*etc.prism/d'
mutant keeps-links DEBIAN/postrm '/wants/d'
echo "$missed missed"
[ "$missed" -eq 0 ]
