# SPDX-License-Identifier: MIT
# Runs in the guest as root, with the functions of the container tests. "HOST plug" and "HOST unplug" on stdout make the host plug and
# unplug the converter.
inside() { "$@"; }
. /deep/checks.sh
. /deep/gyro.sh

# line DEVICE [MEMBERS]: configures the line of the gyro.
line() {
  echo "{\"line\": {\"device\": \"$1\", \"silence_s\": 3, \"retry_min_s\": 0.1, \"retry_max_s\": 0.5${2:+, $2}}, \"frames\": \"/deep/frames.json\"}" >/etc/prism/gyro1.json
}
# facts DEVICE: prints the driver's speed and low-latency flag.
facts() { /usr/bin/python3 /deep/line_facts.py "$1" 2>&1; }
limits() { local group=/sys/fs/cgroup$(property ControlGroup); echo "$(cat "$group/memory.max") $(cat "$group/pids.max")"; }

uname -r
becomes 60 "systemd runs without failed units" running systemctl is-system-running
check "both packages install" dpkg --install /deep/prism.deb /deep/prism-tools.deb
systemctl enable --quiet --now "$socket"

line /dev/ttyS1 '"baud": 115200'
contains "16550: a request of a group member starts the daemon" "$(ask version 2>&1)" '"prismd"'
becomes 20 "16550: the gyro sends data" receiving line_state
same "16550: the group member receives samples" "$(ask watch --samples --count 50 2>&1 | grep -c rate_deg_per_h)" 50
same "16550: speed as configured, low latency" "$(facts /dev/ttyS1)" "115200 low_latency"
same "16550: prismd reads the hardware's counters" "$(ask line | jq -c '.hardware.received > 0')" true
same "limits of memory and tasks are set" "$(limits)" "1073741824 32"
line /dev/ttyS1 '"baud": 614400'
systemctl reload "$unit"
becomes 20 "16550: an unsupported speed is an error" /dev/ttyS1: line_state
contains "16550: the status names the unsupported speed" "$(property StatusText)" 614400
line /dev/ttyS2 '"baud": 115200'
systemctl reload "$unit"
becomes 20 "16550 on PCI: the gyro sends data" receiving line_state

pid=$(property MainPID)
line /dev/prism/GYRO0001-if00
systemctl reload "$unit"
becomes 10 "FTDI: the daemon waits for a missing converter" /dev/prism/GYRO0001-if00: line_state
echo "HOST plug"
becomes 60 "FTDI: plugged in after the start, the gyro sends data" receiving line_state
same "FTDI: speed as configured, low latency" "$(facts /dev/prism/GYRO0001-if00)" "921600 low_latency"
same "FTDI: latency timer" "$(cat /sys/bus/usb-serial/devices/ttyUSB0/latency_timer)" 1
echo "HOST unplug"
becomes 30 "FTDI: unplugged, the status names the device" /dev/prism/GYRO0001-if00: line_state
same "FTDI: unplugged, its device link is removed" "$(exit_code test -e /dev/prism/GYRO0001-if00)" 1
echo "HOST plug"
becomes 60 "FTDI: replugged, the gyro sends data" receiving line_state
same "the process was never restarted" "$(property MainPID)/$(property NRestarts)" "$pid/0"
verdict && echo "GUEST good" || echo "GUEST bad"
