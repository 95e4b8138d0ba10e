// Every message of MCAP files as Foxglove finds them: by the index, with `@mcap/core`.
//
//     node indexed.mjs FILE...      one line of JSON a file, in their order:
//     {"messages": [[topic, log time, SHA-256 of the data], ...], "late": [how many after the middle, by topic]}
import { createHash } from "node:crypto";
import { open } from "node:fs/promises";

import { McapIndexedReader } from "@mcap/core";

function readable(file) {
  return {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, size) => {
      const buffer = Buffer.alloc(Number(size));
      const { bytesRead } = await file.read(buffer, 0, buffer.length, Number(offset));
      if (bytesRead !== buffer.length) throw new Error(`asked for ${size} bytes, got ${bytesRead}`);
      return new Uint8Array(buffer.buffer, buffer.byteOffset, bytesRead);
    },
  };
}

for (const path of process.argv.slice(2)) {
  const file = await open(path);
  const reader = await McapIndexedReader.Initialize({ readable: readable(file) });
  const messages = [];
  for await (const message of reader.readMessages()) {
    const digest = createHash("sha256").update(message.data).digest("hex");
    messages.push([reader.channelsById.get(message.channelId).topic, message.logTime.toString(), digest]);
  }
  const { messageStartTime, messageEndTime } = reader.statistics;
  const late = {};
  for (const { topic } of reader.channelsById.values()) {
    late[topic] = 0;
    const startTime = messageStartTime + (messageEndTime - messageStartTime) / 2n;
    for await (const _ of reader.readMessages({ topics: [topic], startTime })) late[topic] += 1;
  }
  console.log(JSON.stringify({ messages, late }));
  await file.close();
}
