# SPDX-License-Identifier: MIT
# Remove stops the daemon and keeps configuration and logs; purge removes all files.
check "the instance stops within 10 s" timeout 10 nsenter --target "$leader" --all -- systemctl stop "$socket" "$unit"
same "the instance stopped without an error" "$(property Result)" success
check "the socket file is removed" inside test ! -e "$address"
inside systemctl enable --quiet --now "$socket" "$unit"
same "instance and socket are active again" "$(property ActiveState)/$(property ActiveState "$socket")" active/active
check "remove" inside dpkg --remove prism-tools prism
same "remove stops instance and socket" "$(property ActiveState)/$(property ActiveState "$socket")" inactive/inactive
check "remove keeps the configuration" inside test -f /etc/prism/gyro1.json
check "remove keeps the log" inside sh -c 'ls /var/log/prismd/gyro1/*.csv'
unplug
inside rm -rf /etc/systemd/system/prismd@.service.d
inside systemctl daemon-reload
check "purge" inside dpkg --purge prism prism-tools
same "purge leaves no file" "$(comm -13 "$box/before" <(named_prism) | xargs)" ""
same "systemd runs without failed units" "$(inside systemctl is-system-running)" running
