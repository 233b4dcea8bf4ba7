# SPDX-License-Identifier: MIT
# prismd-net@: installed disabled, allows no address until IPAddressAllow= is set, and excludes prismd@ of the same instance.
net=prismd-net@gyro1.service
same "the network unit is disabled" "$(inside systemctl is-enabled "$net" 2>&1)" disabled
same "systemd-analyze verify prints no warnings for it" "$(inside systemd-analyze verify --man=no "$net" prismd-net@gyro1.socket 2>&1)" ""
same "it allows no address" "$(property IPAddressAllow "$net")" ""
same "it denies every address" "$(property IPAddressDeny "$net" | tr ' ' '\n' | sort | paste -sd' ')" "0.0.0.0/0 ::/0"
inside cat /etc/prism/gyro1.json >"$box/serial.json"
inside sh -c 'cat >/etc/prism/gyro1.json' <<<'{"line": {"tcp": {"address": "127.0.0.1:4001"}, "silence_s": 1}, "frames": "/frames.json"}'
contains "--check prints the unit" "$(inside prismd --check /etc/prism/gyro1.json 2>&1)" "unit prismd-net@gyro1"
inside systemd-run --quiet --collect --unit=netgyro prismsim --tcp-listen 127.0.0.1:4001 --frames /frames.json --profile steady
inside sh -c 'mkdir -p /etc/systemd/system/prismd-net@.service.d && printf "[Service]\nIPAddressAllow=127.0.0.1\n" >/etc/systemd/system/prismd-net@.service.d/test.conf && systemctl daemon-reload'
check "it starts" inside systemctl start "$net"
same "prismd@ of the same instance stopped" "$(property ActiveState)" inactive
net_state() { property StatusText "$net" | cut -d' ' -f1; }
becomes 10 "it receives from an allowed address" receiving net_state
inside systemctl stop "$net" prismd-net@gyro1.socket netgyro
inside rm -r /etc/systemd/system/prismd-net@.service.d
inside sh -c 'cat >/etc/prism/gyro1.json && systemctl daemon-reload' <"$box/serial.json"
check "prismd@ starts again" inside systemctl start "$socket" "$unit"
