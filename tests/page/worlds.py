# SPDX-License-Identifier: MIT
"""What a browser test looks at: a stand-in server of simulated gyros."""
import os
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
SCRIPT = "<script>document.title='taken'</script><img src=x onerror=\"document.title='taken'\">"


class StandIn:
    """tests/page/stand_in.py; say("gone gyro1") and the like."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen([sys.executable, os.path.join(HERE, "stand_in.py"), "0", *arguments],
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.url = self.process.stdout.readline().strip()

    def say(self, command):
        self.process.stdin.write(command + "\n")
        self.process.stdin.flush()

    def close(self):
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()
