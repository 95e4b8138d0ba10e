"""YAML as plain data: text, numbers, lists, mappings; nothing that runs, and nothing larger than its text.

PyYAML's safe loader still takes more than files of this suite need: aliases (a few lines stand for more than any memory
holds), dates, binary data, nesting without end, numbers of any length, a key that stands twice, of which the last one
counts; and its constructors fail with whatever Python raises. Here all of that is a yaml.YAMLError, of one line that
begins with the line of the text where the fault is.
"""

from __future__ import annotations

from typing import Any

import yaml

LARGEST = 2**20
"""[letters] A longer text is refused: this parser reads about 60,000 of them a second on a busy core."""
DEEPEST = 50
"""Lists and mappings inside each other."""
LONGEST_NUMBER = 64
"""[letters] No number of the suite needs more."""
_TAG = "tag:yaml.org,2002:"


def plain_yaml(text: str) -> Any:
    """The content of a YAML text. Raises yaml.YAMLError."""
    if len(text) > LARGEST:
        raise yaml.YAMLError(f"{len(text)} letters; at most {LARGEST} are read")
    try:
        return yaml.load(text, Loader=_PlainLoader)  # noqa: S506  (a SafeLoader with less)
    except yaml.MarkedYAMLError as error:
        raise yaml.YAMLError(_fault(error)) from error
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise yaml.YAMLError(f"line {line}: a letter that YAML does not have, number {error.character}") from error


def _fault(error: yaml.MarkedYAMLError) -> str:
    """Where it is, what it is, and in what; the last with the line where that begins."""
    mark, begin = error.problem_mark or error.context_mark, error.context_mark
    where = f"line {mark.line + 1}: " if mark else ""
    since = f" that begins in line {begin.line + 1}" if begin and mark and begin.line != mark.line else ""
    said = [error.problem or "", f"{error.context}{since}" if error.context else ""]
    return where + ", ".join(part for part in said if part)


class _PlainLoader(yaml.SafeLoader):
    """No aliases, bounded depth, and only the tags below; dates are text."""

    yaml_constructors = {  # noqa: RUF012  (as the base class declares it)
        tag: construct
        for tag, construct in yaml.SafeLoader.yaml_constructors.items()
        if tag is None or tag.removeprefix(_TAG) in ("null", "str", "seq", "map")
    }
    yaml_implicit_resolvers = {  # noqa: RUF012
        first: [(tag, pattern) for tag, pattern in known if tag != f"{_TAG}timestamp"]
        for first, known in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }
    _depth = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError("aliases are not read")
        if self._depth == DEEPEST:
            raise yaml.YAMLError(f"lists and mappings more than {DEEPEST} deep")
        self._depth += 1
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node

    def construct_mapping(self, node: yaml.Node, deep: bool = False) -> dict[Any, Any]:
        """No key twice. A node that only its tag calls a mapping is refused by the base class."""
        first: dict[tuple[str, str], int] = {}
        for key, _ in node.value if isinstance(node, yaml.MappingNode) else ():
            if not isinstance(key, yaml.ScalarNode):
                continue
            line, same = key.start_mark.line + 1, (key.tag, key.value)
            if same in first:
                there = f"in line {first[same]} and in line {line}" if line != first[same] else f"both in line {line}"
                raise yaml.YAMLError(f"the key '{key.value[:40]}' stands twice, {there}")
            first[same] = line
        return super().construct_mapping(node, deep)  # type: ignore[arg-type]

    def fetch_flow_collection_start(self, TokenClass: type[yaml.Token]) -> None:
        """The scanner looks far ahead, and takes seconds for a thousand brackets."""
        if self.flow_level == DEEPEST:
            raise yaml.YAMLError(f"brackets more than {DEEPEST} deep")
        super().fetch_flow_collection_start(TokenClass)

    def number(self, node: yaml.ScalarNode) -> object:
        """A whole or broken number, true or false. The text fits its tag, unless the tag was written out."""
        kind = node.tag.removeprefix(_TAG)
        construct = yaml.SafeLoader.yaml_constructors[node.tag]
        problem = f"expected {kind}, found '{str(node.value)[:40]}'"
        if len(node.value) > LONGEST_NUMBER:
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark)
        try:
            return construct(self, node)
        except (ValueError, LookupError) as error:
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark) from error


for _kind in ("bool", "int", "float"):
    _PlainLoader.add_constructor(_TAG + _kind, _PlainLoader.number)
