# SPDX-License-Identifier: MIT
# Runs the probe in the unit's sandbox and, as the control, in a unit without one: the difference is due to the sandbox.
inside sh -c '
  mknod -m 666 /dev/probe-ttyS c 4 65; mknod -m 666 /dev/probe-ttyUSB c 188 7; mknod -m 666 /dev/probe-ttyACM c 166 7
  mknod -m 666 /dev/probe-disk b 7 0; mknod -m 666 /dev/probe-kvm c 10 232
  chmod 755 /root; touch /home/probe-secret /root/probe-secret /tmp/probe-secret'
inside systemctl stop "$unit" 2>/dev/null   # hides the warning "can still be activated"
drop_in ExecStartPre=/usr/lib/prism-probe
check "the unit starts after the probe" inside systemctl start "$unit"
inside cat /var/lib/prismd/gyro1/probe >"$box/sandboxed" || true
inside systemd-run --quiet --wait --collect --property=StateDirectory=control --property=LogsDirectory=control /usr/lib/prism-probe || true
inside cat /var/lib/control/probe >"$box/control" || true

# acts FILE KIND PATTERN: prints the attempts of this kind (needed, forbidden) whose result matches.
acts() { awk -v kind="$2" -v pattern="$3" '$1 == kind && $3 ~ "^(" pattern ")$" {printf "%s%s", sep, $2; sep = " "}' "$1"; }
forbidden=$(acts "$box/sandboxed" forbidden '.*' | wc -w)
same "all $forbidden forbidden attempts fail" "$(acts "$box/sandboxed" forbidden done)" ""
same "all needed attempts succeed" "$(awk '$1 == "needed" && $3 != "done" {print $2, $3}' "$box/sandboxed" | xargs)" ""
free=$(acts "$box/control" forbidden done | wc -w)
echo "      without the sandbox: $free succeed; rejected by the container: $(acts "$box/control" forbidden 'E.*|SIG.*')"
echo "      not in this kernel: $(acts "$box/control" forbidden absent)"
check "without the sandbox at least two thirds of the forbidden attempts succeed" \
  test $((free * 3)) -ge $((forbidden * 2)) -a "$forbidden" -gt 0
rights=$(inside sh -c "grep -E '^(NoNewPrivs|Seccomp|CapBnd|CapEff):' /proc/$(property MainPID)/status" | awk '{print $2}' | xargs)
same "no capabilities, no new privileges, system calls filtered" "$rights" "0000000000000000 0000000000000000 1 2"
drop_in RestartSec=200ms
