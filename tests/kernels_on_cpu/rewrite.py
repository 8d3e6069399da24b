"""Copies a source of cuda/ so that a C++ compiler takes it, with the headers of kernels_on_cpu/include.

rewrite.py FROM TO
Four things are not C++ or not for a CPU: launches by <<<...>>>, the cast of a kernel for a cooperative launch, alignas
after __shared__, and lines of assembler.
"""
import pathlib
import re
import sys

RULES = [
    (r"([\w:]+(?:<\w+>)?)<<<([^;]*)>>>\(", r"kernels_on_cpu::launch(\2, \1, "),
    (r"reinterpret_cast<const void\*>\(kernel\)", "kernel"),
    (r"__shared__ alignas\((\w+)\)", r"alignas(\1) __shared__"),
    (r'asm volatile\("ld\.global[^;]*;"[^;]*;', "value = *from;"),
    (r'asm volatile\("" : "\+r"\(\w+\)\);', ""),
    (r'asm volatile\("mov\.u64 %0, %%globaltimer;"[^;]*;',
     "time = static_cast<unsigned long long>(std::chrono::steady_clock::now().time_since_epoch().count());"),
]


def main():
    origin, target = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    text = origin.read_text()
    for pattern, replacement in RULES:
        text = re.sub(pattern, replacement, text)
    if "<<<" in text or "asm volatile" in text:
        sys.exit(f"{origin}: what rewrite.py does not know")
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(text)


if __name__ == "__main__":
    main()
