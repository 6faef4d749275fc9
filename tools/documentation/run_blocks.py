"""The process in which the blocks of one page are run: ``python -m tools.documentation.run_blocks PAGE``.

It prints a JSON object: what each block printed, by its line.
"""

from __future__ import annotations

import contextlib
import io
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from tools.documentation.pages import Block, blocks, command_lines


def main(path: str) -> None:
    """Run the page at ``path`` in the present folder."""
    sys.path.insert(0, str(Path.cwd()))
    names: dict[str, Any] = {"__name__": "__main__"}
    printed = {}
    for block in blocks(Path(path).read_text()):
        if block.title:
            Path(block.title).write_text(block.text)
        elif block.runs:
            text = _python(block, path, names) if block.language == "python" else _commands(block)
            printed[block.line] = text.replace(f"{Path.cwd()}/", "")
    json.dump(printed, sys.stdout)


def _python(block: Block, path: str, names: dict[str, Any]) -> str:
    # Empty lines before the block: a traceback then names the line of the page.
    code = compile("\n" * (block.line - 1) + block.text, path, "exec")
    with contextlib.redirect_stdout(io.StringIO()) as output:
        exec(code, names)
    return output.getvalue()


def _commands(block: Block) -> str:
    texts = []
    for words in command_lines(block.text):
        done = subprocess.run([sys.executable, "-m", "ddagr_gym", *words], capture_output=True, text=True)
        # 1 is an answer: a check that found something suspicious
        if done.returncode not in (0, 1):
            raise SystemExit(f"./ddagr {' '.join(words)} ended with {done.returncode}:\n{done.stdout}\n{done.stderr}")
        texts.append(done.stdout)
    return "\n".join(texts)


if __name__ == "__main__":
    main(sys.argv[1])
