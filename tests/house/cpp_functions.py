"""Finds the functions of a C++ or CUDA source text: where each starts, how long it is, how many parameters it takes.

A small scanner, not a parser: it needs balanced braces, and it looks at definitions only. A lambda belongs to the
function around it.
"""

import functools
import re
from dataclasses import dataclass

TOKEN = re.compile(
    r'//[^\n]*|/\*.*?\*/|R"\((?:.|\n)*?\)"|"(?:[^"\\\n]|\\.)*"|(?<![0-9A-Fa-f])\'(?:[^\'\\\n]|\\.)+\'', re.DOTALL
)
DIRECTIVE = re.compile(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", re.MULTILINE)
BRACKET = re.compile(r"[(){}\[\]]")
SCOPE = re.compile(r"\b(namespace|class|struct|union|enum|concept)\b|^\s*extern\b[^()]*$")
# Words before a parenthesis that does not open a parameter list.
NO_NAME = {"alignas", "decltype", "noexcept", "requires", "__attribute__", "__launch_bounds__", "explicit", "__align__"}


@dataclass
class Function:
    name: str
    line: int  # of its first word, from 1
    num_lines: int  # from the first word to the closing brace
    num_parameters: int


def blank(text):
    """The text without comments, literals and directives; lines and columns stay."""

    def spaces(match):
        return re.sub(r"[^\n]", " ", match.group(0))

    return DIRECTIVE.sub(spaces, TOKEN.sub(spaces, text))


def end_of_group(text, start):
    """Index after the bracket that closes the one at start."""
    pairs = {"(": ")", "{": "}", "[": "]"}
    stack = []
    for bracket in BRACKET.finditer(text, start):
        c = bracket.group()
        if c in pairs:
            stack.append(pairs[c])
        elif stack and c == stack[-1]:
            stack.pop()
            if not stack:
                return bracket.end()
    return len(text)


def without_template(head):
    """The head of a definition without template<...> clauses in front."""
    head = head.lstrip()
    while head.startswith("template"):
        depth = 0
        for at in range(head.index("<"), len(head)):
            depth += {"<": 1, ">": -1}.get(head[at], 0)
            if depth == 0:
                break
        head = head[at + 1 :].lstrip()
    return head


def count_parameters(group):
    """group: what stands between the parentheses."""
    if not group.strip() or group.strip() == "void":
        return 0
    depth, commas = 0, 0
    for c in group:
        depth += {"(": 1, "[": 1, "{": 1, "<": 1, ")": -1, "]": -1, "}": -1, ">": -1}.get(c, 0)
        commas += c == "," and depth == 0
    return commas + 1


def signature(head):
    """(name, number of parameters) of a function's head, or None."""
    head = re.sub(r"operator\s*\(\s*\)", "operator_call", head)
    at = 0
    while (at := head.find("(", at)) >= 0:
        end = end_of_group(head, at)
        name = re.search(r"([~\w:]+|operator[^\w\s(]+)\s*$", head[:at])
        if name and name.group(1) not in NO_NAME:
            return name.group(1), count_parameters(head[at + 1 : end - 1])
        at = end
    return None


@functools.cache  # a copy of the tree with a planted fault has the same files but one
def functions(text):
    code = blank(text)
    found = []
    head_start, at = 0, 0
    while at < len(code):
        c = code[at]
        if c in ";}":
            head_start = at + 1
        elif c == ":" and re.search(r"\b(public|private|protected)\s*$", code[head_start:at]):
            head_start = at + 1
        elif c in "([":
            at = end_of_group(code, at)
            continue
        elif c == "{":
            head = code[head_start:at]
            bare = without_template(head)
            named = signature(bare)
            is_initialiser = re.search(r"(=|\breturn)\s*$", bare) or named is None
            in_member_list = re.search(r"\)\s*(noexcept\s*)?:(?!:)", bare) and re.search(r"[,:]\s*[\w:<>]+\s*$", bare)
            if SCOPE.search(re.sub(r"\([^()]*\)", "", bare)) and not re.search(r"\)\s*(const)?\s*$", bare):
                head_start = at + 1
            elif in_member_list:
                at = end_of_group(code, at)
                continue
            elif is_initialiser:
                at = end_of_group(code, at)
                continue
            else:
                end = end_of_group(code, at)
                first = head_start + len(head) - len(head.lstrip())
                found.append(
                    Function(
                        named[0],
                        code.count("\n", 0, first) + 1,
                        code.count("\n", first, end) + 1,
                        named[1],
                    )
                )
                at, head_start = end, end
                continue
        at += 1
    return found
