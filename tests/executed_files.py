# SPDX-License-Identifier: MIT
# Counts the files of the project, besides base, that one more frame executes in prismd, one more request in prismweb, or the
# training on a small table in prismcal, built for gcov. A header and its source are one file.
# usage: executed_files.py BUILD frame|request|train MOST
# frame: prismd replays a capture, and the same with one more frame. What only reads the capture and begins and ends the
# replay is not counted.
# request: prismweb gets REQUESTS more. A file that only its timers execute is executed less often and is not counted.
# train: compared with prismcal --version; without compensation/training.
import collections
import glob
import json
import math
import os
import struct
import subprocess
import sys
import tempfile
import time
import urllib.request

SOURCE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
EDGES = {"daemon/replay", "daemon/socket/publisher", "drivers/capture_file"}
CONFIG = {"name": "g", "frames": "trplg", "clock": "device", "site": {"latitude_deg": 34.25, "elevation_deg": 90},
          "model": SOURCE + "/config/models/tao2019-model2.json"}
REQUESTS = 50


def first_frames(capture, count):
    """The bytes of a capture with its first frames; prismsim writes a packet for each."""
    end = 24
    for _ in range(count):
        end += 16 + struct.unpack_from("<I", capture, end + 8)[0]
    return capture[:end]


def counts(build, folder, act):
    """Executions of each line of the project, by file and line, by a program that act(environment) runs."""
    prefix = tempfile.mkdtemp(dir=folder)
    act(os.environ | {"GCOV_PREFIX": prefix})
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


def files_of(before, after, times):
    """Files, without their extensions, with a line that is executed at least that many times more often."""
    return {os.path.splitext(path)[0] for (path, line), count in after.items() if count >= before[path, line] + times}


def files_of_a_frame(build, folder, frames):
    def replay(name, count):
        with open(folder + "/all.pcap", "rb") as whole, open(f"{folder}/{name}.pcap", "wb") as part:
            part.write(first_frames(whole.read(), count))
        command = [build + "/daemon/prismd", "g.json", "--replay", name + ".pcap", "--out", f"{name}{count}"]
        return counts(build, folder, lambda env: subprocess.run(command, check=True, cwd=folder, stdout=subprocess.DEVNULL, env=env))

    return files_of(replay("before", frames), replay("after", frames + 1), 1) - EDGES


def simulate(build, folder, *options):
    subprocess.run([build + "/tools/prismsim/prismsim", *options, "--out", folder + "/all.pcap"], check=True, capture_output=True,
                   env=os.environ | {"GCOV_PREFIX": folder})


def frame(build, folder, most):
    simulate(build, folder, "--profile", "fast", "--hours", "0.05", "--frames", "trplg")
    for what, frames in (("in a second", 30077), ("that ends a second", 30000)):
        print(f"a frame {what}:", *sorted(files := files_of_a_frame(build, folder, frames)))
        assert "daemon/pipeline/pipeline" in files, "found no execution of the pipeline"
        if what == "in a second":
            assert len(files) <= most, f"found {len(files)} files, expected at most {most}"


def requests(build, folder, *targets):
    """Executions of each line by a prismweb that has filled its store and then gets each of the requests REQUESTS times."""
    def serve(env):
        web = subprocess.Popen([build + "/tools/prismweb/prismweb", "--listen", "127.0.0.1:0", "--instance", folder + "/g.sock", "--state",
                                tempfile.mkdtemp(dir=folder)], stdout=subprocess.PIPE, text=True, env=env | {"XDG_RUNTIME_DIR": folder})
        try:
            call(web.stdout.readline().split("#")[0])
            web.terminate()
            assert web.wait() == 0
        finally:
            web.kill()

    def call(url):
        with open(f"{folder}/prismweb-{url.split(':')[2].rstrip('/')}.token") as file:
            token = file.read().strip()

        def get(target):
            return json.load(urllib.request.urlopen(urllib.request.Request(url + "api/" + target, headers={"Authorization": "Bearer " + token}), timeout=60))

        while get("instances")[0]["state"] != "running" or get("g/range?seconds=9").get("building") != 1:
            time.sleep(1)
        for target in targets:
            for _ in range(REQUESTS):
                assert get(target), target

    return counts(build, folder, serve)


def request(build, folder, most):
    with open(SOURCE + "/config/frames/trplg.json") as file:
        slow = file.read().replace('"rate_hz": 200', '"rate_hz": 1')
    with open(folder + "/slow.json", "w") as file:
        file.write(slow)
    with open(folder + "/g.json", "w") as file:
        json.dump(CONFIG | {"frames": "slow.json", "line": {"device": "tty"}, "log": {"directory": "log"}, "socket": {"path": "g.sock"}}, file)
    simulate(build, folder, "--profile", "paper", "--hours", "30", "--frames", folder + "/slow.json")
    env = os.environ | {"GCOV_PREFIX": folder + "/prismd"}
    subprocess.run([build + "/daemon/prismd", "g.json", "--replay", "all.pcap", "--out", "log"], check=True, cwd=folder, stdout=subprocess.DEVNULL, env=env)
    open(folder + "/tty", "w").close()  # an absent gyro: the log does not grow
    prismd = subprocess.Popen([build + "/daemon/prismd", "g.json"], cwd=folder, stderr=subprocess.DEVNULL, env=env)
    try:
        while not os.path.exists(folder + "/g.sock"):
            time.sleep(0.1)
        with open(sorted(glob.glob(folder + "/log/*.csv"))[0]) as file:
            begin_s = next(int(line.split(",")[1]) for line in file if line[0].isdigit())
        idle = requests(build, folder)
        for what, target in (("status", "g/status"), ("range of the last hour", "g/range?seconds=3600"),
                             ("range of a day", "g/range?seconds=86400"),
                             ("range in the log", f"g/range?from_s={begin_s + 60}&to_s={begin_s + 120}")):
            print(f"{what}:", *sorted(files := files_of(idle, requests(build, folder, target), REQUESTS)))
            assert "tools/prismweb/router" in files, "found no execution of the router"
            assert len(files) <= most, f"found {len(files)} files, expected at most {most}"
    finally:
        prismd.terminate()
        prismd.wait()


def train(build, folder, most):
    with open(folder + "/table.csv", "w") as table:
        table.write("time_s,rate [deg/h],T [degC],U [V]\n")
        for i in range(20000):  # two cycles of 40 degC, and a noise of a few hundredths
            degc, uhfo_v = 20 * math.sin(i / 1500), 5.3 + 0.1 * math.sin(i / 700)
            table.write(f"{i},{8.4 + 2e-3 * degc + 0.3 * (uhfo_v - 5.3) + 0.02 * math.sin(i * i):.6f},{degc:.4f},{uhfo_v:.5f}\n")

    def prismcal(*arguments):
        return counts(build, folder, lambda env: subprocess.run([build + "/tools/prismcal/prismcal", *arguments], check=True, cwd=folder,
                                                                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=env))

    trained = prismcal("train", "table.csv", "--map", "rate=rate [deg/h]:deg/h,temperature=T [degC]:degC,uhfo=U [V]:V,time=time_s:s", "--latitude", "34",
                       "--elevation", "90", "--inputs", "T,dTdt,U", "--method", "stepwise", "--out", "model.json")
    files = {file for file in files_of(prismcal("--version"), trained, 1) if not file.startswith("compensation/training/")}
    print(f"training on a table, {len(files)} files:", *sorted(files))
    assert "tools/prismcal/plain_table" in files, "found no execution of the table's reader"
    assert len(files) <= most, f"found {len(files)} files, expected at most {most}"


def main(build, what, most):
    with tempfile.TemporaryDirectory() as folder:
        with open(folder + "/g.json", "w") as file:
            json.dump(CONFIG, file)
        {"frame": frame, "request": request, "train": train}[what](build, folder, most)


main(os.path.abspath(sys.argv[1]), sys.argv[2], int(sys.argv[3]))
