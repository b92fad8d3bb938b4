"""A page of documentation, run as its reader would: block by block, from the top.

```python           is run, all of them in one session
```bash             is run by bash, which stops at the first error
```diff             is applied to the files
```yaml card.yaml   is written to that file, whatever its language is
```text             and any other one is only shown
"""

import re
import subprocess
import sys
from pathlib import Path

FENCE = re.compile(r"^```(\w+)(?: (\S+))?\n(.*?)^```$", re.MULTILINE | re.DOTALL)
BASH = ["bash", "-euxo", "pipefail", "-c"]


def run(page):
    """Run a page in the current folder; raises for the first block that fails."""
    text, session = page.read_text("utf-8"), {"__name__": "__main__"}
    for block in FENCE.finditer(text):
        language, name, code = block.groups()
        if name:
            Path(name).parent.mkdir(parents=True, exist_ok=True)
            Path(name).write_text(code, "utf-8")
        elif language == "python":
            above = "\n" * text.count("\n", 0, block.start(3))  # true line numbers
            exec(compile(above + code, str(page), "exec"), session)
        elif language == "bash":
            subprocess.run([*BASH, code], check=True)
        elif language == "diff":
            subprocess.run(["git", "apply", "-"], input=code, text=True, check=True)


if __name__ == "__main__":
    run(Path(sys.argv[1]))
