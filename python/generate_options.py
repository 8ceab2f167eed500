"""Writes phimvs/options.py: typed options of the commands, from the commands' own descriptions.

usage: generate_options.py FOLDER_WITH_PHIMVS_CORE OUTPUT
"""

import json
import sys
import textwrap

sys.path.insert(0, sys.argv[1])
import _core  # noqa: E402

COMMANDS = {
    "patch_match_stereo": "PatchMatchStereoOptions",
    "hole_filler": "HoleFillerOptions",
    "stereo_fusion": "StereoFusionOptions",
    "dense": "DenseOptions",
    "evaluate": "EvaluateOptions",
    "report": "ReportOptions",
}
ARGUMENTS = {"workspace_path", "output_path", "report_path"}  # of the Python functions
PYTHON_SETS = {"log_level", "log_timestamps"}  # logging's
TYPES = {"bool": "bool", "integer": "int", "number": "float", "text": "str", "path": "str"}


def annotation(option):
    if option["type"] == "choice":
        return "Literal[" + ", ".join(json.dumps(c) for c in option["choices"]) + "]"
    return TYPES[option["type"]]


def default(option):
    text = option["default"]
    if option["type"] == "bool":
        return str(text == "true")
    if option["type"] == "number":
        return repr(float(text))
    return text if option["type"] == "integer" else json.dumps(text)


def attribute(option, name):
    unit = f" [{option['unit']}]" if option["unit"] else ""
    text = json.dumps(option["help"] + unit, ensure_ascii=False)
    value = f'Option("{option["name"]}", {default(option)}, {text})'
    return f"    {name}: {annotation(option)} = {value}  # type: ignore[assignment]"


def write_class(command, class_name):
    description = json.loads(_core.describe_command(command, []))
    own = [o for o in description["options"] if o["name"] not in PYTHON_SETS]
    if command != "evaluate":
        own = [o for o in own if o["name"] not in ARGUMENTS]
    groups, plain = {}, []
    for option in own:
        group, dot, name = option["name"].rpartition(".")
        (groups.setdefault(group, []) if dot else plain).append((option, name))
    lines = []
    for group, options in groups.items():
        lines += [f"class {class_name}_{group}(Group):", f'    """--{group}.* of {command}."""', ""]
        lines += [attribute(*option) for option in options] + ["", ""]
    lines += [f"class {class_name}(CommandOptions):"]
    lines += [f'    """Options of {command}, with the command line\'s names, defaults and checks."""', ""]
    lines += [f'    _command = "{command}"']
    lines += [f"    {group}: {class_name}_{group} = GroupOf({class_name}_{group})  # type: ignore[assignment]" for group in groups]
    lines += [attribute(*option) for option in plain]
    return "\n".join(lines) + "\n"


with open(sys.argv[2], "w", encoding="utf-8") as file:
    header = '''\
    """Typed options of the commands. Made by generate_options.py when the package is built; do not edit."""

    # ruff: noqa: E501
    from typing import Literal

    from ._options import CommandOptions, Group, GroupOf, Option


    '''
    file.write(textwrap.dedent(header))
    file.write("\n\n".join(write_class(*item) for item in COMMANDS.items()))
