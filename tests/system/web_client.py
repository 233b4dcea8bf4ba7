# SPDX-License-Identifier: MIT
# Client of prismweb's WebSocket, based on python3-websockets: web_client.py URL TOKEN COMMAND…
#   hello                  prints the response to the token
#   ask METHOD [PARAMS] [INSTANCE]   prints the response
#   listen SECONDS EVERY   subscribes to all streams; prints counts as JSON
#   deaf SECONDS           subscribes, does not read for SECONDS, then reads until a loss is reported; prints counts as JSON
#   follow SECONDS FILE    subscribes to windows; writes method and time of each notification to FILE
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

PROTOCOL = int(os.environ.get("PRISM_PROTOCOL", "2"))


async def connect(url, token, **options):
    socket = await websockets.connect(url, max_size=None, **options)
    await socket.send(json.dumps({"token": token}))
    return socket, json.loads(await socket.recv())


async def ask(socket, method, params, instance):
    await socket.send(json.dumps({"jsonrpc": "2.0", "id": "q", "protocol": PROTOCOL, "instance": instance, "method": method, "params": params}))
    while True:
        message = json.loads(await socket.recv())
        if message.get("id") == "q":
            return message


class Count:
    def __init__(self):
        self.messages, self.batches, self.samples, self.windows, self.lost, self.holes = 0, 0, 0, 0, 0, 0
        self.begin = self.end = self.last = None
        self.prismd_lost = 0

    def take(self, message):
        self.messages += 1
        if message.get("method") == "lost":
            self.lost = message["params"]["rows_total"]
        if "batch" not in message:
            return
        self.batches += 1
        self.end = time.monotonic()
        self.begin = self.begin or self.end
        for one in message["batch"]:
            params = one["params"]
            if one["method"] == "lost":
                self.prismd_lost += params["rows"]
            self.windows += one["method"] == "window"
            if one["method"] != "sample":
                continue
            self.samples += 1
            if self.last is not None and abs(params["time_s"] - self.last) > 1.5 * PERIOD_S:
                self.holes += 1
            self.last = params["time_s"]

    def figures(self):
        seconds = max(self.end - self.begin, 1e-3) if self.end else 0
        return {
            "samples": self.samples, "windows": self.windows, "holes": self.holes, "lost": self.lost, "prismd_lost": self.prismd_lost,
            "seconds": round(seconds, 3), "messages_per_s": round((self.batches - 1) / seconds, 2) if seconds else 0,
        }


PERIOD_S = 0.001


async def listen(socket, seconds, every, instance):
    global PERIOD_S
    PERIOD_S = 0.001 * every
    count = Count()
    await ask(socket, "subscribe", {"streams": ["sample", "window", "event"], "every": every}, instance)
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        try:
            count.take(json.loads(await asyncio.wait_for(socket.recv(), left)))
        except asyncio.TimeoutError:
            break
    return count.figures()


def small_socket(url):
    """Returns a socket connected to the host of url, with a small receive buffer, so that unread data fills it soon."""
    where = urllib.parse.urlsplit(url)
    plain = socket_module.socket()
    plain.setsockopt(socket_module.SOL_SOCKET, socket_module.SO_RCVBUF, 1 << 16)
    plain.connect((where.hostname, where.port))
    return plain


async def deaf(socket, seconds, instance):
    await socket.send(json.dumps({"jsonrpc": "2.0", "id": 1, "instance": instance, "method": "subscribe", "params": {}}))
    socket.transport.pause_reading()
    await asyncio.sleep(seconds)
    socket.transport.resume_reading()
    count, until = Count(), time.monotonic() + 10
    while time.monotonic() < until and not count.lost:
        count.take(json.loads(await asyncio.wait_for(socket.recv(), 10)))
    return count.figures()


async def follow(socket, seconds, path, instance):
    await ask(socket, "subscribe", {"streams": ["window"]}, instance)
    until = time.monotonic() + seconds
    with open(path, "w") as file:
        while (left := until - time.monotonic()) > 0:
            try:
                message = json.loads(await asyncio.wait_for(socket.recv(), left))
            except asyncio.TimeoutError:
                break
            for one in message.get("batch", [message]):
                what = one["params"].get("time_s") if one["method"] == "window" else json.dumps(one["params"])
                print(one["method"], what, file=file, flush=True)


def secured(url):
    """Returns the options for wss:// with a self-signed certificate, PRISM_BASIC=NAME:PASSWORD and the address PRISM_CONNECT."""
    code = base64.b64encode(os.environ["PRISM_BASIC"].encode()).decode()
    headers, name = {"Authorization": f"Basic {code}"}, urllib.parse.urlsplit(url).hostname
    return {"ssl": ssl._create_unverified_context(), "extra_headers": headers, "host": os.environ["PRISM_CONNECT"], "server_hostname": name}


async def main(url, token, command, *words):
    options = secured(url) if url.startswith("wss:") else {}
    options |= {"max_queue": 1, "read_limit": 4096, "sock": small_socket(url)} if command == "deaf" else {}
    try:
        socket, hello = await connect(url, token, **options)
    except websockets.InvalidStatusCode as refused:
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
        print(json.dumps(await listen(socket, float(words[0]), int(words[1]), instance)))
    elif command == "deaf":
        print(json.dumps(await deaf(socket, float(words[0]), instance)))
    elif command == "follow":
        await follow(socket, float(words[0]), words[1], instance)
    await socket.close()


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
