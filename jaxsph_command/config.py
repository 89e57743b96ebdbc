"""`--config run.toml`: the words of a command, kept in a file.

Each key is an option without its dashes, or `scene`; lists are several values, `true` is a flag.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import tomllib
from pathlib import Path
from typing import Any

from .errors import Parser

NAME = "run.toml"
_POSITIONAL = ("scene", "model", "file")
# what says where results go and whence a run goes on, rather than what is run
_PLACES = ("out", "json", "runs", "overwrite", "config")
_OF_ONE_CALL = (*_PLACES, "resume", "from_step", "from_time")


def add_config_option(parser: Parser) -> None:
    """Tell of the option; its words are there before anything is parsed."""
    parser.add_argument(
        "--config",
        metavar="FILE",
        help=f"a {NAME} whose options come before those given here; runs leave one",
    )


def expanded(words: list[str]) -> list[str]:
    """The words of a command line, those of its configuration first.

    Raises:
        ValueError: if the file cannot be read, or is of another command.
    """
    for k, word in enumerate(words[1:], 1):
        option, equals, value = word.partition("=")
        if option == "--config" and (equals or k + 1 < len(words)):
            path = Path(value if equals else words[k + 1])
            rest = words[1:k] + words[k + 1 + (not equals) :]
            return [words[0], *_words(path, words[0]), *rest]
    return words


def typed(parser: Parser, words: list[str]) -> dict[str, Any]:
    """What is given to a command, by option, as it is typed."""
    for action in parser._actions:  # there is no public list of them
        action.type = action.choices = None
        action.default = argparse.SUPPRESS
    parser._defaults.clear()
    return {name: _value(given) for name, given in vars(parser.parse_args(words)).items()}


def write_config(path: Path, options, **changed: Any) -> None:
    """Write what repeats a command; a scene's file is told of from the folder that it is in.

    Args:
        path: of the file.
        options: of the command.
        changed: options that are other than they were typed.
    """
    kept = {k: v for k, v in {**options.typed, **changed}.items() if k not in _OF_ONE_CALL}
    file, colon, function = str(kept.get("scene", "")).partition(":")
    if file.endswith(".py"):
        kept["scene"] = os.path.relpath(file, path.parent) + colon + function
    lines = [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in kept.items()]
    told = f"# {options.program} {options.name} --config {path.name} --out DIR runs this again"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join([told, f'command = "{options.name}"', *lines, ""]), encoding="utf-8")


def repeating(options) -> str:
    """The command that was given, without where its files are."""
    words = [options.program, options.name]
    for key, value in options.typed.items():
        if key in _PLACES:
            continue
        given = value if isinstance(value, list) else [value]
        flag = [] if key in _POSITIONAL else ["--" + key.replace("_", "-")]
        if key == "set":
            words += [word for item in given for word in ("--set", str(item))]
        elif value is True or value is False:
            words.append(flag[0] if value else flag[0].replace("--", "--no-", 1))
        else:
            words += [*flag, *(_without_folder(str(item)) for item in given)]
    return shlex.join(words)


def _without_folder(word: str) -> str:
    return Path(word).name if os.sep in word else word


def read_config(path: Path) -> dict[str, Any]:
    """Options by name.

    Raises:
        ValueError: if the file cannot be read.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or error
        raise ValueError(f"--config: {path} cannot be read ({why}); give a TOML file.") from None


def _words(path: Path, command: str) -> list[str]:
    kept = read_config(path)
    of = kept.pop("command", command)
    if of != command:
        raise ValueError(f"--config: {path} is of the command {of}, not of {command}.")
    words = []
    scene = kept.pop("scene", None)
    if scene is not None:
        beside = path.parent / str(scene)
        own = str(scene).partition(":")[0]
        words.append(str(beside if own.endswith(".py") else scene))
    for key, value in kept.items():
        option = "--" + key.replace("_", "-")
        if isinstance(value, bool):
            words.append(option if value else option.replace("--", "--no-", 1))
        elif key == "set":
            items = value if isinstance(value, list) else [value]
            words += [f"{option}={item}" for item in items]
        elif isinstance(value, list):
            words += [option, *map(str, value)]
        elif isinstance(value, dict):
            raise ValueError(f"--config: {path}: {key} is a table; give values or lists.")
        else:
            words.append(f"{option}={value}")
    return words


def _value(given: Any) -> Any:
    """Numbers as numbers."""
    if isinstance(given, list):
        return [_value(item) for item in given]
    for kind in (int, float):
        try:
            number = kind(given) if isinstance(given, str) else given
        except ValueError:
            continue
        return number if not isinstance(number, float) or abs(number) < float("inf") else given
    return given
