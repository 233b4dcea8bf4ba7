# SPDX-License-Identifier: MIT
# The largest accepted and the first refused value of each limit of configurations and models.
python3 -B "$SOURCE/tests/outputs/check.py" "$SOURCE/tests/outputs/limits.txt"
