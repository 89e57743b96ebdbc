"""A page for each scene, made from its function, its options and stored results.

`scenes/index.md` and the others are not in the repository: they are generated as the site is built,
with what each scene is, the command that runs it, its options with units, and how near it comes to
its reference where a benchmark has measured that.
"""

import inspect
import sys
from pathlib import Path

from mkdocs.structure.files import File

from jaxsph.scenes import SCENES
from jaxsph_command.commands import parser
from jaxsph_command.scenes import scenes

sys.path.insert(0, str(Path(__file__).parent))
from scene_figures import figure, measured

ROOT = Path(__file__).parents[2]


def pages() -> dict[str, str]:
    """Markdown by the path of each page."""
    sizes = {name: (summary, sizes) for name, summary, sizes in scenes()}
    found = {f"scenes/{name}.md": page(name, sizes[name][1]) for name in SCENES}
    lines = "\n".join(
        f"| [{name}]({name}.md) | {told} | {_small(name)} |" for name, (told, _) in sizes.items()
    )
    head = "# Scenes\n\n`jaxsph run SCENE` runs one.\n\n| Scene | What it is | |\n|---|---|---|"
    return {"scenes/index.md": f"{head}\n{lines}\n", **found}


def page(name: str, sizes: dict) -> str:
    """What a scene is, how it is run, what it can be given, and how near it comes."""
    make = SCENES[name]
    text = inspect.getdoc(make).partition("\nArgs:")[0].strip()
    parts = [f"# {name}", text]
    still = picture(name)
    if still is not None:
        parts.append(f"![{name}](../figures/{still})")
    parts.append(f"```bash\njaxsph run {name}\njaxsph animate out/{name}/trajectory.h5\n```")
    lines = "\n".join(
        f"| `{size}` | {of['resolution']} | {of['h_over_dx']:g} | {of['time_step']:g} |"
        for size, of in sizes.items()
    )
    head = "| `--scale` | resolution | h / dx | dt [s] |\n|---|---|---|---|"
    parts.append(f"## Sizes\n\n{head}\n{lines}")
    lines = "\n".join(f"| `{flag}` | {told} |" for flag, told in options(name))
    parts.append(f"## Settings\n\n| Option | What it is |\n|---|---|\n{lines}")
    found = measured(name)
    if found is not None:
        parts.append(
            f"## How near it comes\n\n![Errors of {name}](../figures/measured_{name}.png)\n\n"
            f"{found.label[0].upper()}{found.label[1:]}, of the runs in `benchmarks/results/"
            f"{found.file}.json` (`python -m benchmarks.{found.script}`)."
        )
    where = f"{make.__module__}.{make.__name__}"
    parts.append(f"From Python: [`jaxsph.scenes.{make.__name__}`][{where}].")
    return "\n\n".join(parts) + "\n"


def options(name: str) -> list[tuple[str, str]]:
    """The options by which a scene's own settings are given, and their help."""
    chosen = parser("jaxsph", ["run", name]).chosen
    settings = chosen.get_default("settings")
    return [
        (f"{action.option_strings[0]} {_values(action)}".strip(), _cell(action.help % vars(action)))
        for action in chosen._actions
        if action.dest in settings
    ]


def _values(action) -> str:
    if action.choices is not None:
        return "{" + ", ".join(action.choices) + "}"
    metavar = action.metavar or action.dest.upper()
    return " ".join([metavar] * (action.nargs if isinstance(action.nargs, int) else 1))


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


def _small(name: str) -> str:
    found = picture(name)
    return "" if found is None else f"![{name}](../figures/{found}){{ width=180 }}"


def picture(name: str) -> str | None:
    """The file of a scene's picture in `docs/figures`, if there is one."""
    stem = name.replace("-", "_")
    files = (f"{stem}.gif", f"scene_{stem}.png")
    return next((file for file in files if (ROOT / "docs" / "figures" / file).exists()), None)


def on_config(config):
    entry = next(part["Scenes"] for part in config.nav if "Scenes" in part)
    entry += [{name: f"scenes/{name}.md"} for name in SCENES]
    return config


def on_files(files, config):
    for path, text in pages().items():
        files.append(File.generated(config, path, content=text))
    for name in SCENES:
        found = measured(name)
        if found is not None:
            path = f"figures/measured_{name}.png"
            files.append(File.generated(config, path, content=figure(found)))
    return files
