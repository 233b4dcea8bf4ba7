// SPDX-License-Identifier: MIT
// Foxglove's own client of its protocol, looking at prismweb: client.mjs URL SUBPROTOCOL SECONDS TOPIC… subscribes to the topics as they are
// advertised, holds each message against its channel's schema, and prints what came as one line of JSON.
import protocol from "@foxglove/ws-protocol";
import Ajv from "ajv/dist/2020.js";
import { WebSocket } from "ws";

const [url, subprotocol, seconds, ...wanted] = process.argv.slice(2);
const socket = new WebSocket(url, [subprotocol]);
const client = new protocol.FoxgloveClient({ ws: socket });
const seen = { protocol: null, server: null, advertised: [], gone: [], status: [], errors: [], topics: {} };
const channels = new Map(), subscriptions = new Map(), ajv = new Ajv({ allErrors: true });

client.on("error", (error) => seen.errors.push(String(error.message ?? error)));
client.on("serverInfo", ({ name, capabilities }) => { seen.server = { name, capabilities }; });
client.on("status", ({ level, message }) => seen.status.push({ level, message }));
client.on("advertise", (fresh) => {
  seen.protocol = socket.protocol;
  for (const channel of fresh) {
    channels.set(channel.id, channel);
    seen.advertised.push(channel.topic);
    if (!wanted.includes(channel.topic)) continue;
    const judge = ajv.compile(JSON.parse(channel.schema));
    seen.topics[channel.topic] ??= { messages: 0, unlike_schema: 0, backward: 0, unlike_time: 0, first: null };
    subscriptions.set(client.subscribe(channel.id), { judge, seen: seen.topics[channel.topic], last: 0n });
  }
});
client.on("unadvertise", (ids) => seen.gone.push(...ids.map((id) => channels.get(id).topic)));
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const of = subscriptions.get(subscriptionId), value = JSON.parse(new TextDecoder().decode(data));
  of.seen.messages += 1;
  of.seen.first ??= value;
  if (!of.judge(value)) of.seen.unlike_schema += 1;
  if (timestamp < of.last) of.seen.backward += 1;
  if (Math.abs(Number(timestamp) / 1e9 - value.time_s) > 1e-5) of.seen.unlike_time += 1;
  of.last = timestamp;
});
socket.on("unexpected-response", (request, response) => {
  seen.errors.push(`HTTP ${response.statusCode}`);
  finish();
});

function finish() {
  console.log(JSON.stringify(seen));
  process.exit(0);
}
setTimeout(finish, 1000 * Number(seconds));
