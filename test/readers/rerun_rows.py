"""Every message of MCAP files as Rerun loads them. Run by the Python of `.venv-rerun`.

python rerun_rows.py FILE...      one line of JSON a file, in their order:
{"messages": [[topic, log time, SHA-256 of the data], ...], "rows": number of rows with Rerun's own decoders}
"""

from __future__ import annotations

import hashlib
import json
import sys

from rerun.chunk import McapReader


def main() -> None:
    for path in sys.argv[1:]:
        messages = []
        for chunk in McapReader(path, decoders=["raw"]).stream().to_chunks():
            batch = chunk.to_record_batch()
            times, contents = (batch.column(name) for name in ("message_log_time", "McapMessage:data"))
            for time, (content,) in zip(times, contents.to_pylist(), strict=True):
                digest = hashlib.sha256(bytes(content)).hexdigest()
                messages.append([chunk.entity_path, str(time.value), digest])
        decoded = McapReader(path).stream().to_chunks()
        print(json.dumps({"messages": messages, "rows": sum(c.num_rows for c in decoded if not c.is_static)}))


if __name__ == "__main__":
    main()
