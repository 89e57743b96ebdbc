"""A page for each notebook, with its text, its code and its outputs as they are committed."""

import base64
import json
import re
from pathlib import Path

from mkdocs.structure.files import File

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))


def page(notebook: Path) -> tuple[str, dict[str, bytes]]:
    """Markdown, and the pictures that it shows by their names."""
    parts, pictures = [], {}
    for cell in _cells(notebook):
        if cell["cell_type"] != "code":
            parts.append(_text(cell["source"]))
            continue
        parts.append(f"```python\n{_text(cell['source'])}\n```")
        for output in cell["outputs"]:
            data = output.get("data", {})
            if "image/png" in data:
                name = f"{notebook.stem}_{len(pictures) + 1}.png"
                pictures[name] = base64.b64decode(_text(data["image/png"]))
                parts.append(f"![What the cell draws]({name})")
            elif text := _text(output.get("text", data.get("text/plain", ""))).strip("\n"):
                parts.append(f"```text\n{text}\n```")
    told = f"*This is `notebooks/{notebook.name}`, as it is kept with its outputs.*"
    head, *rest = parts
    head = re.sub(r"\A(# .+)\n", rf"\1\n\n{told}\n", head + "\n")
    return "\n\n".join([head, *rest]) + "\n", pictures


def _cells(notebook: Path) -> list[dict]:
    return json.loads(notebook.read_text(encoding="utf-8"))["cells"]


def _text(source: str | list[str]) -> str:
    return "".join(source)


def on_config(config):
    entry = next(part["Notebooks"] for part in config.nav if "Notebooks" in part)
    entry += [f"notebooks/{notebook.stem}.md" for notebook in NOTEBOOKS]
    return config


def on_files(files, config):
    for notebook in NOTEBOOKS:
        text, pictures = page(notebook)
        files.append(File.generated(config, f"notebooks/{notebook.stem}.md", content=text))
        for name, content in pictures.items():
            files.append(File.generated(config, f"notebooks/{name}", content=content))
    return files
