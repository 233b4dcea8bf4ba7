# SPDX-License-Identifier: MIT
# An upgrade restarts what runs, starts nothing that does not, and leaves the configuration alone.
inside sh -c 'cp /etc/prism/gyro1.json /etc/prism/gyro2.json'
inside systemctl restart "$unit"
pid=$(property MainPID)
before=$(inside sha256sum /etc/prism/gyro1.json)
check "a later version installs" inside dpkg --force-depends --install /next.deb
becomes 5 "the running instance is up" active property ActiveState
check "in a new process" test "$(property MainPID)" -ne "$pid"
same "an instance that did not run still does not" "$(property ActiveState prismd@gyro2.service)" inactive
same "the configuration is untouched" "$(inside sha256sum /etc/prism/gyro1.json)" "$before"
becomes 5 "the gyro delivers" receiving line_state
