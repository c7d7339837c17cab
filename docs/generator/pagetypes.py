"""The types of the page's messages in TypeScript, from the classes that decode and encode them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping

from msgspec import NODEFAULT
from msgspec import inspect as types

from elib.base.plaintext import summary
from elib.panel.server.conversation import Answer, Failure, Message
from elib.panel.server.messages import MESSAGES, TOLD
from elib.panel.server.world import BODY, CUT, FRONT, HEADER, KEPT, RAYS, TOUCHING
from elib.studio import messages as studio_messages

PLAIN: Mapping[type[types.Type], str] = {
    types.IntType: "number",
    types.FloatType: "number",
    types.StrType: "string",
    types.BytesType: "string",  # base64
    types.BoolType: "boolean",
    types.NoneType: "null",
    types.AnyType: "unknown",
}
HEAD = """// What the page may ask for and what it is told, by the classes of elib. Do not edit; renew it with:
// .venv/bin/python docs/generate_reference.py
"""
WIDTH = 120


class Types:
    """Types in TypeScript.

    Attributes:
        named: The classes that they name.
    """

    def __init__(self) -> None:
        self.named: dict[str, type] = {}

    def of(self, kind: types.Type) -> str:
        """Return a type."""
        match kind:
            case types.Metadata(type=inner, extra_json_schema=more):
                more = more or {}
                values = more.get("enum", [more["const"]] if "const" in more else None)
                return self.of(inner) if values is None else " | ".join(map(json.dumps, values))
            case types.LiteralType(values=values):
                return " | ".join(map(json.dumps, values))
            case types.ListType(item_type=item) | types.VarTupleType(item_type=item):
                text = self.of(item)
                return f"({text})[]" if " | " in text and not text.startswith("[") else f"{text}[]"
            case types.TupleType(item_types=items):
                return f"[{', '.join(map(self.of, items))}]"
            case types.DictType(value_type=value):
                return f"Record<string, {self.of(value)}>"
            case types.UnionType(types=parts):
                return " | ".join(dict.fromkeys(map(self.of, parts)))
            case types.StructType(cls=cls) | types.DataclassType(cls=cls):
                assert self.named.setdefault(cls.__name__, cls) is cls, f"two classes are called {cls.__name__}"
                return cls.__name__
        return PLAIN[type(kind)]

    def fields(self, cls: type, *, is_asked: bool = False) -> list[str]:
        """Return the fields of a class; one that may be left out has a question mark."""
        info = types.type_info(cls)
        assert isinstance(info, types.StructType | types.DataclassType)
        found = [f"{info.tag_field}: {json.dumps(info.tag)}"] if isinstance(info, types.StructType) and info.tag else []
        for field in info.fields:
            is_unset = not field.required and field.default is NODEFAULT and field.default_factory is NODEFAULT
            mark = "?" if is_unset or (is_asked and not field.required) else ""
            found.append(f"{field.encode_name}{mark}: {self.of(field.type)}")
        return found

    def declared(self, cls: type) -> str:
        """Return the declaration of a class."""
        return f"\n{_comment(cls)}export type {cls.__name__} = {_object(self.fields(cls), '')};\n"


def module() -> str:
    """Return the module of what all pages may say and are told."""
    frame = {"header": HEADER.size, "rays": RAYS, "kept": KEPT}
    frame |= {"touching": TOUCHING, "body": BODY, "front": FRONT, "cut": CUT}
    numbers = ", ".join(f"{name}: {value}" for name, value in frame.items())
    about = "A frame: bytes of its header, flags for rays and for a moment to go back to, bits of a robot."
    return _module(MESSAGES, TOLD, f"\n/** {about} */\nexport const FRAME = {{ {numbers} }};\n")


def studio() -> str:
    """Return the module of what only the studio may say and is told."""
    return _module(studio_messages.MESSAGES, studio_messages.TOLD)


def _module(messages: Mapping[str, type[Message]], told: Iterable[type], more: str = "") -> str:
    found = Types()
    body = ["\n/** What the page may ask for: the fields of each request. */\nexport type Asked = {\n"]
    for name, cls in messages.items():
        fields = [field for field in found.fields(cls, is_asked=True)[1:] if not field.startswith("id?")]
        body.append(f"{_comment(cls, '  ')}  {name}: {_object(fields, '  ')};\n")
    body.append("};\n\n/** What requests are answered with; all others with null. */\nexport type Answered = {\n")
    answers = {name: cls.answers for name, cls in messages.items() if cls.answers not in (None, type(None))}
    body += [f"  {name}: {found.of(types.type_info(kind))};\n" for name, kind in answers.items()]
    names = " | ".join(cls.__name__ for cls in told if cls not in (Answer, Failure))
    body.append(f"}};\n{more}\n/** What the page is told without having asked. */\nexport type Told = {names};\n")
    for each in told:
        found.of(types.type_info(each))
    written: set[str] = set()
    while new := [cls for name, cls in found.named.items() if name not in written]:
        written |= {cls.__name__ for cls in new}
        body += map(found.declared, new)
    return HEAD + "".join(body)


def _comment(cls: type, indent: str = "") -> str:
    return f"{indent}/** {summary(cls)} */\n"


def _object(fields: list[str], indent: str) -> str:
    """Return an object type: a short one within another in one line, all others with a line for each field."""
    if not fields:
        return "Record<string, never>"
    line = f"{{ {'; '.join(fields)} }}"
    if indent and len(line) < WIDTH - 20:
        return line
    return "{\n" + "".join(f"{indent}  {_cut(field, indent)};\n" for field in fields) + f"{indent}}}"


def _cut(field: str, indent: str) -> str:
    """Return a field; a union that is too long for a line has a line for each part."""
    name, _, kind = field.partition(": ")
    if len(f"{indent}  {field};") <= WIDTH:
        return field
    return f"{name}:" + "".join(f"\n{indent}    | {part}" for part in kind.split(" | "))
