# SPDX-License-Identifier: MIT
# The program behind tools/fleet. usage: fleet.py PROGRAMS GYROS SECONDS FAKE_SERVERS BACKLOG (FAKE_SERVERS: 1 or 0)
import glob
import json
import os
import pwd
import shutil
import signal
import subprocess
import sys
import tempfile
import time

BIN, GYROS, SECONDS, STAND_INS, BACKLOG = sys.argv[1], int(sys.argv[2]), float(sys.argv[3]), sys.argv[4] == "1", int(sys.argv[5])
HERE = os.path.dirname(os.path.abspath(__file__))
SOURCE = os.path.dirname(os.path.dirname(HERE))
TICK = os.sysconf("SC_CLK_TCK")
EVERY_S = 5

folder = tempfile.mkdtemp(prefix="prism-fleet.")
os.chmod(folder, 0o755)
children = []
relay = None


def start(*command, **more):
    child = subprocess.Popen(command, **more)
    children.append(child)
    return child


def postgres_bin():
    found = sorted(glob.glob("/usr/lib/postgresql/*/bin"))
    if not found:
        sys.exit("tools/fleet: PostgreSQL is not installed; run tools/setup all")
    return found[-1]


def as_server(*command, **more):
    """Runs the command as user postgres if this is root: PostgreSQL does not run as root."""
    prefix = ["runuser", "-u", "postgres", "--"] if os.getuid() == 0 else []
    return subprocess.run([*prefix, *command], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd="/", **more)


def start_postgres():
    data = folder + "/pg"
    os.mkdir(data)
    if os.getuid() == 0:
        os.chown(data, pwd.getpwnam("postgres").pw_uid, -1)
    as_server(postgres_bin() + "/initdb", "-D", data + "/data", "-A", "trust", "-U", "relay", "--locale=C", "-E", "UTF8")
    as_server(postgres_bin() + "/pg_ctl", "-D", data + "/data", "-w", "-l", data + "/log", "-o",
              f"-k {data} -c listen_addresses='' -c shared_buffers=256MB -c max_wal_size=2GB", "start")
    as_server(postgres_bin() + "/createdb", "-h", data, "-U", "relay", "prism")


def sql(statement):
    out = subprocess.run(["psql", "-X", "-q", "-A", "-t", "-h", folder + "/pg", "-U", "relay", "prism", "-c", statement],
                         capture_output=True, text=True)
    if out.returncode:
        raise RuntimeError(out.stderr.strip())
    return out.stdout.strip()


def start_gyros():
    if STAND_INS:
        child = start(sys.executable, HERE + "/stand_in.py", folder, str(GYROS), "--backlog", str(BACKLOG), stdout=subprocess.PIPE, text=True)
        print(child.stdout.readline().strip())
        return
    for i in range(1, GYROS + 1):
        name = f"gyro{i:04}"
        config = {"line": {"device": f"{folder}/{name}.tty"}, "frames": "trplg", "model": "tao2019-model2",
                  "log": {"directory": f"{folder}/log/{name}"}, "socket": {"path": f"{folder}/{name}.sock"}}
        open(f"{folder}/{name}.json", "w").write(json.dumps(config))
        start(BIN + "/tools/prismsim/prismsim", "--link", f"{folder}/{name}.tty", "--frames", "trplg", "--seed", str(i), stderr=subprocess.DEVNULL)
        while not os.path.exists(f"{folder}/{name}.tty"):
            time.sleep(0.02)
        start(BIN + "/daemon/prismd", f"{folder}/{name}.json", stderr=subprocess.DEVNULL)
    print(f"{GYROS} simulated gyros at 200 frames/s, a prismd each")


def start_relay():
    open(folder + "/relay.json", "w").write(json.dumps(
        {"site": "fleet", "instances": folder + "/", "status_file": "status.json",
         "postgresql": {"connection": f"host={folder}/pg dbname=prism user=relay"}}))
    program = BIN + "/tools/prismrelay/prismrelay"
    subprocess.run([program, "--init", folder + "/relay.json"], check=True, stdout=subprocess.DEVNULL)
    return start(program, folder + "/relay.json", stderr=open(folder + "/relay.log", "w"))


def cpu_s(pid):
    fields = open(f"/proc/{pid}/stat").read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def memory_mb(pid, key="VmHWM"):
    return next(int(line.split()[1]) for line in open(f"/proc/{pid}/status") if line.startswith(key)) / 1024


def lags():
    """Returns median and maximum over the logs of the relay's last lag: from the arrival of a row to its commit, s."""
    logs = json.load(open(folder + "/status.json"))["logs"]
    known = sorted(log["lag_s"] for log in logs if log["lag_s"] is not None)
    return known[len(known) // 2] if known else float("nan"), known[-1] if known else float("nan")


def bare_copy():
    """Returns the rows/s of one COPY of the same rows, by psql into the same table, which was emptied: the upper limit of the database."""
    count, path = int(sql("SELECT count(*) FROM prism.rows")), folder + "/pg/rows.csv"
    sql(f"COPY (SELECT * FROM prism.rows) TO '{path}' (FORMAT csv)")
    sql("TRUNCATE prism.rows")
    begin = time.monotonic()
    sql("\\copy prism.rows FROM '" + path + "' (FORMAT csv)")
    return count / (time.monotonic() - begin)


def report(begun):
    first_rows, first_cpu, first = 0, cpu_s(relay.pid), time.monotonic()
    rows, cpu, then = first_rows, first_cpu, first
    caught_up = None
    while not SECONDS or time.monotonic() - begun < SECONDS:
        time.sleep(0.5 if BACKLOG and not caught_up else min(EVERY_S, SECONDS or EVERY_S))
        now_rows, now_cpu, now = int(sql("SELECT coalesce(sum(rows), 0) FROM prism.places")), cpu_s(relay.pid), time.monotonic()
        middle, worst = lags()
        print(f"{now - begun:6.1f} s  {now_rows:9} rows  {(now_rows - rows) / (now - then):8.0f} rows/s  lag median {middle:6.2f} s, worst "
              f"{worst:6.2f} s  relay {100 * (now_cpu - cpu) / (now - then):5.1f} % of a core, {memory_mb(relay.pid, 'VmRSS'):.0f} MB", flush=True)
        rows, cpu, then = now_rows, now_cpu, now
        if BACKLOG and not caught_up and rows >= GYROS * BACKLOG:
            caught_up = (rows - first_rows) / (now - first)
            print(f"caught up: {caught_up:.0f} rows/s")
            if not SECONDS:
                break
    seconds = time.monotonic() - first
    print(f"\n{GYROS} gyros, {seconds:.0f} s: {rows} rows, {rows / seconds:.0f} rows/s; relay {100 * (cpu_s(relay.pid) - first_cpu) / seconds:.1f} % of a core, "
          f"{memory_mb(relay.pid):.0f} MB max; the table uses {int(sql('SELECT sum(bytes) FROM prism.days')) / max(rows, 1):.0f} bytes per row")
    if caught_up:
        bare = bare_copy()
        print(f"backlog: {caught_up:.0f} rows/s; bare COPY of the same rows: {bare:.0f} rows/s; ratio {caught_up / bare:.2f}")


def end(*_):
    raise KeyboardInterrupt


signal.signal(signal.SIGTERM, end)
try:
    start_postgres()
    start_gyros()
    begun = time.monotonic()
    relay = start_relay()
    while not os.path.exists(folder + "/status.json"):
        time.sleep(0.05)
    report(begun)
except KeyboardInterrupt:
    print()
finally:
    for child in reversed(children):
        child.terminate()
    for child in children:
        child.wait()
    try:
        as_server(postgres_bin() + "/pg_ctl", "-D", folder + "/pg/data", "-m", "immediate", "-w", "stop")
    except subprocess.CalledProcessError:
        pass
    shutil.rmtree(folder, ignore_errors=True)
