# SPDX-License-Identifier: MIT
# Rows and counts of streams with damage, gaps, jumps of counters and clocks.
python3 -B "$SOURCE/tests/outputs/streams.py" "$SOURCE/tests/outputs/streams.txt"
