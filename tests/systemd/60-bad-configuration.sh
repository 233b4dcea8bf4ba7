# SPDX-License-Identifier: MIT
# An invalid configuration ends prismd once with exit code 78 and a message about the error; systemd does not restart it.
inside sh -c 'echo "{\"line\": {\"baudd\": 1}}" >/etc/prism/bad.json'
refuse "an instance with an invalid configuration does not start" inside systemctl start prismd@bad
sleep 0.5   # more than RestartSec in these tests
same "it exited with 78 and is not restarted" \
  "$(property ExecMainStatus prismd@bad)/$(property NRestarts prismd@bad)/$(property ActiveState prismd@bad)" 78/0/failed
contains "the journal names the invalid key" "$(journal prismd@bad.service)" "bad.json:/line/baudd"
inside systemctl reset-failed prismd@bad
inside rm /etc/prism/bad.json
