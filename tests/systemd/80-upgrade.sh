# SPDX-License-Identifier: MIT
# An upgrade restarts running instances, starts no others and keeps the configuration.
inside sh -c 'cp /etc/prism/gyro1.json /etc/prism/gyro2.json'
inside systemctl restart "$unit"
pid=$(property MainPID)
before=$(inside sha256sum /etc/prism/gyro1.json)
check "a later version installs" inside dpkg --force-depends --install /next.deb
becomes 10 "the instance that ran is active, with a new process" active state_after "$pid" "$unit"
same "the instance that did not run is inactive" "$(property ActiveState prismd@gyro2.service)" inactive
same "the configuration is unchanged" "$(inside sha256sum /etc/prism/gyro1.json)" "$before"
becomes 5 "the gyro sends data" receiving line_state
