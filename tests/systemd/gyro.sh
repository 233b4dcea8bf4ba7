# SPDX-License-Identifier: MIT
# The instance under test, prismd@gyro1 on a virtual gyro at /dev/gyro0, and those who talk to it.
unit=prismd@gyro1.service
socket=prismd@gyro1.socket
address=/run/prismd/gyro1.sock

property() { inside systemctl show --property="$1" --value "${2:-$unit}"; }
restarts_and_state() { echo "$(property NRestarts)/$(property ActiveState)"; }
line_state() { property StatusText | cut -d' ' -f1; }
journal() { inside journalctl --quiet --no-pager --output=cat --unit="${1:-$unit}"; }
# drop_in LINE...: what the test adds to the [Service] of the unit, from the next start on.
drop_in() {
  inside sh -c 'mkdir -p /etc/systemd/system/prismd@.service.d && cat >/etc/systemd/system/prismd@.service.d/test.conf &&
    systemctl daemon-reload' < <(printf '[Service]\n'; printf '%s\n' "$@")
}

# A process of another person; the second is a member of the group prism.
stranger() { inside setpriv --reuid=65534 --regid=65534 --clear-groups timeout 5 "$@"; }
client() { inside setpriv --reuid=65534 --regid=65534 --groups="$(inside getent group prism | cut -d: -f3)" timeout 10 "$@"; }
ask() { client prismctl --json --socket "$address" "$@"; }
configured() { ask config | jq "$1"; }

# The gyro is plugged in and out: a pseudo-terminal that dialout may open, as a serial line is.
plug() {
  inside systemd-run --quiet --collect --unit=gyro prismsim --link /dev/gyro0 --frames /frames.json --profile steady
  becomes 5 "plugged in: the line is there" 0 exit_code inside test -e /dev/gyro0
  inside sh -c 'chgrp dialout "$(readlink -f /dev/gyro0)" && chmod 660 "$(readlink -f /dev/gyro0)"'
}
unplug() { inside systemctl stop gyro; }
