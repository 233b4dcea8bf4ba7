# SPDX-License-Identifier: MIT
# The instance under test, prismd@gyro1, with a virtual gyro at /dev/gyro0, and its clients.
unit=prismd@gyro1.service
socket=prismd@gyro1.socket
address=/run/prismd/gyro1.sock

property() { inside systemctl show --property="$1" --value "${2:-$unit}"; }
restarts_and_state() { echo "$(property NRestarts)/$(property ActiveState)"; }
# state_after PID UNIT: prints the state of the unit once its process is another one: until systemd notices a death, the state is old.
state_after() { [ "$(property MainPID "$2")" != "$1" ] && property ActiveState "$2"; }
line_state() { property StatusText | cut -d' ' -f1; }
journal() { inside journalctl --quiet --no-pager --output=cat --unit="${1:-$unit}"; }
# drop_in LINE...: replaces the test's additions to [Service] of the unit; effective from the next start.
drop_in() {
  inside sh -c 'mkdir -p /etc/systemd/system/prismd@.service.d && cat >/etc/systemd/system/prismd@.service.d/test.conf &&
    systemctl daemon-reload' < <(printf '[Service]\n'; printf '%s\n' "$@")
}

# Run a command as another user: stranger without groups, client as a member of the group prism.
stranger() { inside setpriv --reuid=65534 --regid=65534 --clear-groups timeout 5 "$@"; }
client() { inside setpriv --reuid=65534 --regid=65534 --groups="$(inside getent group prism | cut -d: -f3)" timeout 10 "$@"; }
ask() { client prismctl --json --socket "$address" "$@"; }
configured() { ask config | jq "$1"; }

# Plug the gyro in and out: a pseudo-terminal that the group dialout may open, like a serial line.
plug() {
  inside systemd-run --quiet --collect --unit=gyro prismsim --link /dev/gyro0 --frames /frames.json --profile steady
  becomes 5 "plugged in: the line exists" 0 exit_code inside test -e /dev/gyro0
  inside sh -c 'chgrp dialout "$(readlink -f /dev/gyro0)" && chmod 660 "$(readlink -f /dev/gyro0)"'
}
unplug() { inside systemctl stop gyro; }
