"""Options of a scene by name, e.g. "personalize.iterations". Names and ranges come from the API."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Any, Dict, Mapping, Optional, Tuple

from google.protobuf import text_format
from google.protobuf.descriptor import FieldDescriptor

from color3d.errors import InputError
from color3d.v1 import colorize_scene_pb2, option_pb2

_Spec = colorize_scene_pb2.ColorizeSceneSpec
_Option = Tuple[Optional[FieldDescriptor], FieldDescriptor]  # stage (None: whole scene), field


def read_preset(name_or_file: str) -> colorize_scene_pb2.ColorizeSceneSpec:
    """Returns a spec that names the preset, or the one in a file of protobuf's text format.

    Raises InputError if there is neither preset nor file, and for errors in the file.
    """
    presets = {n[len("PRESET_") :].lower(): v for n, v in colorize_scene_pb2.Preset.items() if v}
    if name_or_file in presets:
        return _Spec(preset=presets[name_or_file])
    if not Path(name_or_file).is_file():
        raise InputError(
            f"preset '{name_or_file}': there is no such preset (there are {', '.join(presets)}) "
            "and no such file"
        )
    try:
        return text_format.Parse(Path(name_or_file).read_text(encoding="utf-8"), _Spec())
    except (text_format.ParseError, UnicodeDecodeError) as e:
        raise InputError(
            f"preset {name_or_file}: {e}; `color3d server presets fast` prints a valid one"
        ) from None


def set_options(spec: colorize_scene_pb2.ColorizeSceneSpec, options: Mapping[str, Any]) -> None:
    """Sets options by name: {"stage.field": value}, or {"field": value} for the whole scene.

    Values are numbers, bool, str, and for enums names, with or without prefix: "adam".
    proto/README.md lists all options with range, unit and default. Raises InputError with the
    option and its range, or with the most similar option.
    """
    known = _all_options()
    for name, value in options.items():
        if name not in known:
            raise InputError(f"there is no option '{name}'" + _advice(name, known))
        stage, field = known[name]
        message = getattr(spec, stage.name) if stage else spec
        setattr(message, field.name, _checked(name, field, value))


def _all_options() -> Dict[str, _Option]:
    options: Dict[str, _Option] = {}
    for stage in _Spec.DESCRIPTOR.fields:
        if stage.cpp_type != FieldDescriptor.CPPTYPE_MESSAGE:
            if (
                stage.GetOptions().Extensions[option_pb2.option].HasField("min")
            ):  # its other fields are arguments of their own
                options[stage.name] = (None, stage)
        elif stage.label != FieldDescriptor.LABEL_REPEATED and stage.name != "key_color":
            for field in stage.message_type.fields:
                is_message = field.cpp_type == FieldDescriptor.CPPTYPE_MESSAGE
                if not is_message and field.label != FieldDescriptor.LABEL_REPEATED:
                    options[f"{stage.name}.{field.name}"] = (stage, field)
    return options


def _advice(name: str, known: Mapping[str, _Option]) -> str:
    of_stage = [n for n in known if n.startswith(name + ".")]
    if of_stage:
        return f": it is a stage; its options are {', '.join(of_stage)}"
    same = [n for n in known if n.endswith("." + name)] or difflib.get_close_matches(name, known, 1)
    return f"; did you mean {' or '.join(same)}?" if same else "; proto/README.md lists them"


def _checked(name: str, field: FieldDescriptor, value: Any) -> Any:
    """Returns the value as the type of the field. The server checks combinations."""
    info = field.GetOptions().Extensions[option_pb2.option]
    accepted, good = "text", isinstance(value, str)
    if field.enum_type:
        names = [v.name for v in field.enum_type.values]
        prefix = names[0][: -len("UNSPECIFIED")]
        text = prefix + str(value).upper().replace(prefix, "", 1)
        good = text in names[1:]
        value = field.enum_type.values_by_name[text].number if good else value
        accepted = ", ".join(n[len(prefix) :].lower() for n in names[1:])
    elif field.cpp_type == FieldDescriptor.CPPTYPE_BOOL:
        accepted, good = "True or False", isinstance(value, bool)
    elif field.cpp_type != FieldDescriptor.CPPTYPE_STRING:
        whole = field.cpp_type != FieldDescriptor.CPPTYPE_DOUBLE
        accepted = (
            f"a {'whole ' if whole else ''}number, {info.min:.12g} to {info.max:.12g} {info.unit}"
        )
        good = isinstance(value, (int, float)) and not isinstance(value, bool)
        good = good and info.min <= value <= info.max and (not whole or value == int(value))
        value = int(value) if good and whole else value
    if not good:
        raise InputError(f"{name} is {value!r}; it must be {accepted.strip()}")
    return value
