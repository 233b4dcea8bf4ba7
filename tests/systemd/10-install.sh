# SPDX-License-Identifier: MIT
# Installed beside a running systemd: a group, nothing started, nothing that systemd would grumble about.
named_prism() { inside find /etc /usr /var /run /dev -iname '*prism*' -not -path '/run/log/*' -not -path '/var/log/journal/*' 2>/dev/null | sort; }
named_prism >"$box/before"
same "systemd runs without failed units" "$(inside systemctl is-system-running)" running
check "both packages install" inside dpkg --install /prism.deb /prism-tools.deb
check "the group prism is made" inside getent group prism
same "no instance is started by the installation" "$(inside systemctl list-units --no-legend 'prismd@*')" ""
# Its exit status is 0 even for keys that systemd does not know.
same "systemd-analyze verify says nothing" "$(inside systemd-analyze verify --man=no "$unit" "$socket" 2>&1)" ""
check "exposure is 0.4 at most" inside systemd-analyze security --offline=true --threshold=4 --no-pager /usr/lib/systemd/system/prismd@.service
