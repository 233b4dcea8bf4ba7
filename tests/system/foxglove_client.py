# SPDX-License-Identifier: MIT
# Client of /foxglove of prismweb that checks the bytes, based on python3-websockets: foxglove_client.py URL COMMAND…
#   refused [HEADER=VALUE | protocol=NAME]…   prints the status of the response, or the agreed protocol
#   talk                                      sends valid and invalid requests and checks the responses
#   count SECONDS STREAM                      prints the number of messages of a stream, of gaps and of times that do not increase
#   axes                                      subscribes to the windows of each axis that appears, until it is killed
#   deaf SECONDS                              subscribes to all samples, does not read for SECONDS, then prints the reported loss
import asyncio
import json
import struct
import sys
import time

sys.dont_write_bytecode = True
import websockets
from web_client import small_socket

FIRST = "foxglove.websocket.v1"


async def open_socket(url, **options):
    """Returns the socket, and the ids of the server's channels by topic."""
    socket = await websockets.connect(url, subprotocols=[FIRST], max_size=None, compression=None, **options)
    server, advertised = json.loads(await socket.recv()), json.loads(await socket.recv())
    assert server["op"] == "serverInfo" and advertised["op"] == "advertise", (server, advertised)
    return socket, {channel["topic"]: channel["id"] for channel in advertised["channels"]}


def parts(data):
    opcode, subscription, time_ns = struct.unpack_from("<BIQ", data)
    assert opcode == 1, opcode
    return subscription, time_ns, json.loads(data[13:])


async def send(socket, op, **members):
    await socket.send(json.dumps({"op": op, **members}))


async def subscribe(socket, **numbers):
    await send(socket, "subscribe", subscriptions=[{"id": int(key[1:]), "channelId": value} for key, value in numbers.items()])


async def until(socket, wanted, seconds=5.0):
    """Returns the first message for which wanted(message) is true. A data message is (subscription, time_ns, value)."""
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        message = await asyncio.wait_for(socket.recv(), left)
        value = parts(message) if isinstance(message, bytes) else json.loads(message)
        if wanted(value):
            return value
    raise AssertionError("timed out")


def is_data(number):
    return lambda value: isinstance(value, tuple) and value[0] == number


def is_status(text):
    return lambda value: isinstance(value, dict) and value["op"] == "status" and value["level"] == 1 and text in value["message"]


async def refused(url, *words):
    headers = dict(word.split("=", 1) for word in words)
    offered = headers.pop("protocol", FIRST)
    try:
        socket = await websockets.connect(url, subprotocols=[offered] if offered else None, extra_headers=headers)
    except websockets.InvalidStatusCode as answer:
        print(answer.status_code)
        return
    print(socket.subprotocol)
    await socket.close()


async def talk(url):
    socket, topics = await open_socket(url)
    window, sample = topics["/gyro/z/window"], topics["/gyro/z/sample"]
    await subscribe(socket, _7=window)
    await until(socket, is_data(7))
    wrong = [{"subscriptions": [{"id": 7, "channelId": sample}]}, {"subscriptions": [{"id": 8, "channelId": window}]},
             {"subscriptions": [{"id": 9, "channelId": 4711}]}, {"subscriptions": [{"id": -1, "channelId": sample}]}, {"subscriptions": 1}, {}]
    for members in wrong:
        await send(socket, "subscribe", **members)
        await until(socket, is_status('expected a new "id"'))
    for members in {"subscriptionIds": [4711]}, {"subscriptionIds": "x"}, {}:
        await send(socket, "unsubscribe", **members)
        await until(socket, is_status("expected the id of a subscription"))
    for text in '{"op":"advertise","channels":[]}', "{", "[]", '{"op":1}', b"\x01data", "[" * 1000:
        await socket.send(text)
        await until(socket, is_status("expected subscribe or unsubscribe"))
    await subscribe(socket, _4294967295=sample)
    await until(socket, is_data(4294967295))
    await until(socket, is_data(7))
    await send(socket, "unsubscribe", subscriptionIds=[4294967295])
    end = time.monotonic() + 1  # skip messages that are already sent
    while time.monotonic() < end:
        await socket.recv()
    for _ in range(2):
        number, time_ns, value = await until(socket, lambda value: isinstance(value, tuple))
        assert number == 7 and value["axis"] == "z" and "samples" in value and time_ns == value["time_s"] * 10**9, (number, value)
    await subscribe(socket, _4294967295=topics["/gyro/event"])  # the id is free again
    print("good")


async def count(url, seconds, stream):
    socket, topics = await open_socket(url)
    await subscribe(socket, _1=topics[f"/gyro/z/{stream}"])
    times, end = [], time.monotonic() + float(seconds)
    while (left := end - time.monotonic()) > 0:
        try:
            message = await asyncio.wait_for(socket.recv(), left)
        except asyncio.TimeoutError:
            break
        if isinstance(message, bytes):
            times.append(parts(message)[1])
    steps = [later - earlier for earlier, later in zip(times, times[1:])]
    shortest = min(steps)
    print(json.dumps({"messages": len(times), "holes": sum(step > 1.5 * shortest for step in steps), "backward": sum(step <= 0 for step in steps)}))


async def axes(url):
    """Subscribes to the windows of each axis that appears; prints new and removed topics, statuses, and the first data of each axis."""
    socket, topics = await open_socket(url)
    print("ready", *topics, flush=True)
    names, received = {}, set()
    async for message in socket:
        if isinstance(message, bytes):
            number, _, value = parts(message)
            if number not in received:
                received.add(number)
                print("data", value["axis"], flush=True)
            continue
        value = json.loads(message)
        for channel in value.get("channels", []):
            names[channel["id"]] = channel["topic"]
            if channel["topic"].endswith("/window"):
                await subscribe(socket, **{f"_{len(received) + 1}": channel["id"]})
        if value["op"] in ("advertise", "unadvertise"):
            print(value["op"], *sorted(names[id] for id in value.get("channelIds", [channel["id"] for channel in value.get("channels", [])])), flush=True)
        elif value["op"] == "status":
            print(value["message"], flush=True)


async def deaf(url, seconds):
    socket, topics = await open_socket(url, sock=small_socket(url), max_queue=1, read_limit=4096)
    await subscribe(socket, _1=topics["/gyro/z/sample"])
    socket.transport.pause_reading()
    await asyncio.sleep(float(seconds))
    socket.transport.resume_reading()
    loss = await until(socket, is_status("rows were dropped"), 20)
    await until(socket, is_data(1))
    print(loss["message"])


async def main(url, command, *words):
    await {"refused": refused, "talk": talk, "count": count, "axes": axes, "deaf": deaf}[command](url, *words)


asyncio.run(main(*sys.argv[1:]))
