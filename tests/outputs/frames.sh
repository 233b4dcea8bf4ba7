# SPDX-License-Identifier: MIT
# The values of frames by fields of each kind, and the limits of frame descriptions.
python3 -B "$SOURCE/tests/outputs/check.py" "$SOURCE/tests/outputs/frames.txt"
