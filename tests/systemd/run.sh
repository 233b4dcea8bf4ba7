#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Tests the packages under a real systemd, from installation to purge, on a temporary copy of this machine.
# usage: run.sh PRISM.deb PRISM-TOOLS.deb PRISM-RELAY.deb PRISM-WEB.deb PROBE      (ctest: systemd.packages; tools/check --system: the release's packages)
# Exit code 0 if every check passed, 1 if one failed, 77 if no container can run here.
set -euo pipefail
export LC_ALL=C.UTF-8   # the order of sort, and no warnings of perl
here=$(cd "$(dirname "$0")" && pwd)
. "$here/container.sh"
trap container_down EXIT
. "$here/checks.sh"
. "$here/gyro.sh"

[ $# -eq 5 ] || { echo "run.sh: found $# arguments, expected PRISM.deb PRISM-TOOLS.deb PRISM-RELAY.deb PRISM-WEB.deb PROBE" >&2; exit 64; }
obstacle=$(container_obstacle)
[ -z "$obstacle" ] || { echo "skipped: no container can run here: $obstacle"; exit 77; }

# For the upgrade: the same package with a later version.
dpkg-deb --raw-extract "$1" "$box/next"
sed -i 's/^Version: .*/&+next/' "$box/next/DEBIAN/control"
dpkg-deb -Znone --root-owner-group --build "$box/next" "$box/next.deb" >/dev/null

container_up --bind-ro="$(realpath "$1")":/prism.deb --bind-ro="$(realpath "$2")":/prism-tools.deb \
  --bind-ro="$box/next.deb":/next.deb --bind-ro="$(realpath "$3")":/prism-relay.deb \
  --bind-ro="$(realpath "$4")":/prism-web.deb --bind-ro="$(realpath "$5")":/usr/lib/prism-probe
echo "booted $(inside systemctl --version | head -1) after $(elapsed_ms) ms"
set +e   # from here on, a failure is a line of the report
for subject in "$here"/[0-9]*.sh; do
  echo "-- $(basename "$subject" .sh), $(elapsed_ms) ms"
  . "$subject"
done
verdict
