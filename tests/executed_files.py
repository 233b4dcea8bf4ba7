# SPDX-License-Identifier: MIT
# Counts the files of the project, besides base, that one more frame executes: prismd replays a capture, and the same
# with one more frame, built for gcov. A header and its source are one file. What only reads the capture and begins
# and ends the replay is not counted. usage: executed_files.py BUILD MOST
import collections
import glob
import json
import os
import struct
import subprocess
import sys
import tempfile

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
EDGES = {"daemon/replay", "daemon/socket/publisher", "drivers/capture_file"}
CONFIG = {"name": "g", "frames": "trplg", "clock": "device", "site": {"latitude_deg": 34.25, "elevation_deg": 90},
          "model": SOURCE + "/config/models/tao2019-model2.json"}


def first_frames(capture, count):
    """The bytes of a capture with its first frames; prismsim writes a packet for each."""
    end = 24
    for _ in range(count):
        end += 16 + struct.unpack_from("<I", capture, end + 8)[0]
    return capture[:end]


def counts(build, folder, command):
    """Executions of each line of the project, by file and line."""
    prefix = tempfile.mkdtemp(dir=folder)
    subprocess.run(command, check=True, cwd=folder, stdout=subprocess.DEVNULL, env=os.environ | {"GCOV_PREFIX": prefix})
    found = collections.Counter()
    for data in glob.glob(prefix + "/**/*.gcda", recursive=True):
        os.symlink(data[len(prefix):-len("gcda")] + "gcno", data[:-len("gcda")] + "gcno")
        text = subprocess.run(["gcov", "--json-format", "--stdout", data], capture_output=True, text=True, cwd=build).stdout
        for document in map(json.loads, text.splitlines()):
            for file in document["files"]:
                path = os.path.relpath(os.path.join(document["current_working_directory"], file["file"]), SOURCE)
                if not path.startswith((".", "base/", "build/")):
                    found.update({(path, line["line_number"]): line["count"] for line in file["lines"]})
    return found


def files_of_a_frame(build, folder, frames):
    """Files, without their extensions, that execute more for frame `frames` + 1."""
    run = []
    for name, count in (("before", frames), ("after", frames + 1)):
        with open(folder + "/all.pcap", "rb") as whole, open(f"{folder}/{name}.pcap", "wb") as part:
            part.write(first_frames(whole.read(), count))
        run.append(counts(build, folder, [build + "/daemon/prismd", "g.json", "--replay", name + ".pcap", "--out", f"{name}{count}"]))
    return {os.path.splitext(path)[0] for (path, line), count in run[1].items() if count > run[0][path, line]} - EDGES


def main(build, most):
    with tempfile.TemporaryDirectory() as folder:
        with open(folder + "/g.json", "w") as file:
            json.dump(CONFIG, file)
        subprocess.run([build + "/tools/prismsim/prismsim", "--profile", "fast", "--hours", "0.05", "--frames", "trplg", "--out",
                        folder + "/all.pcap"], check=True, capture_output=True, env=os.environ | {"GCOV_PREFIX": folder})
        for what, frames in (("in a second", 30077), ("that ends a second", 30000)):
            print(f"a frame {what}:", *sorted(files := files_of_a_frame(build, folder, frames)))
            assert "daemon/pipeline/pipeline" in files, "found no execution of the pipeline"
            if what == "in a second":
                assert len(files) <= most, f"found {len(files)} files, expected at most {most}"


main(os.path.abspath(sys.argv[1]), int(sys.argv[2]))
