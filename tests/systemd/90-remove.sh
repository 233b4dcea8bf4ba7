# SPDX-License-Identifier: MIT
# Remove ends the daemon and keeps what a person made; purge leaves nothing.
check "it stops before the patience of systemd ends" timeout 10 nsenter --target "$leader" --all -- systemctl stop "$socket" "$unit"
same "and well" "$(property Result)" success
check "the socket is gone with it" inside test ! -e "$address"
inside systemctl enable --quiet --now "$socket" "$unit"
same "both are up again" "$(property ActiveState)/$(property ActiveState "$socket")" active/active
check "remove" inside dpkg --remove prism-tools prism
same "remove stops both" "$(property ActiveState)/$(property ActiveState "$socket")" inactive/inactive
check "and keeps the configuration" inside test -f /etc/prism/gyro1.json
check "and the log" inside sh -c 'ls /var/log/prismd/gyro1/*.csv'
unplug
inside rm -rf /etc/systemd/system/prismd@.service.d
inside systemctl daemon-reload
check "purge" inside dpkg --purge prism prism-tools
same "purge leaves nothing" "$(comm -13 "$box/before" <(named_prism) | xargs)" ""
same "systemd runs without failed units" "$(inside systemctl is-system-running)" running
