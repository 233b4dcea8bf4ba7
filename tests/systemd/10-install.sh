# SPDX-License-Identifier: MIT
# Installation under a running systemd creates a group, starts no instance, and systemd reports no problem with the units.
named_prism() { inside find /etc /usr /var /run /dev -iname '*prism*' -not -path '/run/log/*' -not -path '/var/log/journal/*' 2>/dev/null | sort; }
named_prism >"$box/before"
same "systemd runs without failed units" "$(inside systemctl is-system-running)" running
check "both packages install" inside dpkg --install /prism.deb /prism-tools.deb
check "the group prism is created" inside getent group prism
same "the installation starts no instance" "$(inside systemctl list-units --no-legend 'prismd@*')" ""
# Compares the output, because the exit status is 0 even for unknown keys.
same "systemd-analyze verify prints no warnings" "$(inside systemd-analyze verify --man=no "$unit" "$socket" 2>&1)" ""
check "exposure is at most 0.4" \
  inside systemd-analyze security --offline=true --threshold=4 --no-pager /usr/lib/systemd/system/prismd@.service
