# SPDX-License-Identifier: MIT
# What a person must mend is not tried again and again: exit code 78, once, with a line that says what to mend.
inside sh -c 'echo "{\"line\": {\"baudd\": 1}}" >/etc/prism/bad.json'
refuse "an instance with a bad configuration does not start" inside systemctl start prismd@bad
sleep 0.5   # more than RestartSec in these tests
same "it exited with 78 and is not tried again" \
  "$(property ExecMainStatus prismd@bad)/$(property NRestarts prismd@bad)/$(property ActiveState prismd@bad)" 78/0/failed
contains "the journal says what to mend" "$(journal prismd@bad.service)" "bad.json:/line/baudd"
inside systemctl reset-failed prismd@bad
inside rm /etc/prism/bad.json
