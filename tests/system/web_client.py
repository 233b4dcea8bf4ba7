# SPDX-License-Identifier: MIT
# Client of prismweb's WebSocket, based on python3-websockets: web_client.py URL TOKEN COMMAND…
#   hello                  prints the response to the token
#   ask METHOD [PARAMS] [INSTANCE]   prints the response
#   listen SAMPLES EVERY   subscribes to all streams until SAMPLES came; prints counts as JSON
#   deaf                   subscribes, and does not read until a loss is reported; prints counts as JSON
#   follow FILE            subscribes to windows; writes method and time of each notification to FILE, until a window came after a
#                          notification about the instances
# All commands print "refused STATUS" or "closed CODE" if the server does not admit them.
import asyncio
import base64
import json
import os
import socket as socket_module
import ssl
import sys
import time
import urllib.parse

import websockets
from websockets.legacy.client import connect as open_socket  # of Debian 12 and 13

PROTOCOL = int(os.environ.get("PRISM_PROTOCOL", "2"))


async def connect(url, token, **options):
    socket = await open_socket(url, max_size=None, **options)
    await socket.send(json.dumps({"token": token}))
    return socket, json.loads(await socket.recv())


async def ask(socket, method, params, instance):
    await socket.send(json.dumps({"jsonrpc": "2.0", "id": "q", "protocol": PROTOCOL, "instance": instance, "method": method, "params": params}))
    while True:
        message = json.loads(await socket.recv())
        if message.get("id") == "q":
            return message


class Count:
    def __init__(self, every=1):
        self.batches, self.samples, self.windows, self.lost, self.holes = 0, 0, 0, 0, 0
        self.begin, self.first, self.last = time.monotonic(), None, None
        self.prismd_lost = 0
        self.period_s = 0.001 * every

    def take(self, message):
        if message.get("method") == "lost":
            self.lost = message["params"]["rows_total"]
        if "batch" not in message:
            return
        self.batches += 1
        for one in message["batch"]:
            params = one["params"]
            if one["method"] == "lost":
                self.prismd_lost += params["rows"]
            self.windows += one["method"] == "window"
            if one["method"] != "sample":
                continue
            self.samples += 1
            # a batch has 40 samples; prismd's clock may step by a few milliseconds while the computer is busy
            if self.last is not None and abs(params["time_s"] - self.last) > 20 * self.period_s:
                self.holes += 1
            self.first = self.first or params["time_s"]
            self.last = params["time_s"]

    def figures(self):
        """messages_per_s: since before the subscription, so that a slow client never finds too many."""
        return {
            "samples": self.samples, "windows": self.windows, "holes": self.holes, "lost": self.lost, "prismd_lost": self.prismd_lost,
            "messages_per_s": round(self.batches / (time.monotonic() - self.begin), 2),
            "step_ms": round(1000 * (self.last - self.first) / (self.samples - 1), 2) if self.samples > 1 else None,
        }


async def listen(socket, samples, every, instance):
    count = Count(every)
    await ask(socket, "subscribe", {"streams": ["sample", "window", "event"], "every": every}, instance)
    while count.samples < samples:
        count.take(json.loads(await socket.recv()))
    return count.figures()


def small_socket(url):
    """Returns a socket connected to the host of url, with a small receive buffer, so that unread data fills it soon."""
    where = urllib.parse.urlsplit(url)
    plain = socket_module.socket()
    plain.setsockopt(socket_module.SOL_SOCKET, socket_module.SO_RCVBUF, 1 << 16)
    plain.connect((where.hostname, where.port))
    return plain


async def deaf(socket, instance):
    await socket.send(json.dumps({"jsonrpc": "2.0", "id": 1, "instance": instance, "method": "subscribe", "params": {}}))
    count, pause_s = Count(), 14
    while not count.lost:
        socket.transport.pause_reading()
        await asyncio.sleep(pause_s)
        socket.transport.resume_reading()
        until = time.monotonic() + 2
        while time.monotonic() < until and not count.lost:
            count.take(json.loads(await socket.recv()))
        pause_s *= 2
    return count.figures()


async def follow(socket, path, instance):
    await ask(socket, "subscribe", {"streams": ["window"]}, instance)
    changed = False
    with open(path, "w") as file:
        while True:
            message = json.loads(await socket.recv())
            for one in message.get("batch", [message]):
                what = one["params"].get("time_s") if one["method"] == "window" else json.dumps(one["params"])
                print(one["method"], what, file=file, flush=True)
                changed = changed or one["method"] == "instances"
                if changed and one["method"] == "window":
                    return


def secured(url):
    """Returns the options for wss:// with a self-signed certificate, PRISM_BASIC=NAME:PASSWORD and the address PRISM_CONNECT."""
    code = base64.b64encode(os.environ["PRISM_BASIC"].encode()).decode()
    headers, name = {"Authorization": f"Basic {code}"}, urllib.parse.urlsplit(url).hostname
    return {"ssl": ssl._create_unverified_context(), "extra_headers": headers, "host": os.environ["PRISM_CONNECT"], "server_hostname": name}


async def main(url, token, command, *words):
    options = secured(url) if url.startswith("wss:") else {}
    options |= {"max_queue": 1, "read_limit": 4096, "ping_interval": None, "sock": small_socket(url)} if command == "deaf" else {}
    try:
        socket, hello = await connect(url, token, **options)
    except websockets.exceptions.InvalidStatusCode as refused:
        print("refused", refused.status_code)
        return
    except websockets.ConnectionClosed as closed:
        print("closed", closed.code)
        return
    instance = hello["instances"][0]["name"] if hello["instances"] else ""
    if command == "hello":
        print(json.dumps(hello))
    elif command == "ask":
        params = json.loads(words[1]) if len(words) > 1 else {}
        print(json.dumps(await ask(socket, words[0], params, words[2] if len(words) > 2 else instance)))
    elif command == "listen":
        print(json.dumps(await listen(socket, int(words[0]), int(words[1]), instance)))
    elif command == "deaf":
        print(json.dumps(await deaf(socket, instance)))
    elif command == "follow":
        await follow(socket, words[0], instance)
    await socket.close()


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
