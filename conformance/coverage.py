#!/usr/bin/env python3
"""Lines of the decoder that the conformance vectors alone run, module by module, and each stretch
that they do not. Needs cargo-llvm-cov.

    conformance/coverage.py

Functions of the encoder, and those that only tell the caller something, are not counted."""

import re
import subprocess
import tempfile

from mutate import FILES, ROOT, decodes

# What callers ask, and what encoders and samplers compute: no decoding runs these.
CALLERS = re.compile(r"""\b(tick_rate|tracks|points|position|buckets|cells|dirty_\w+|default|name|fmt|key|cell_of|hash|bucket|bucket_of_key|volume|check_finite|finish
|grid|coding|number|Volume::values)$""".replace("\n", ""))


def functions(text):
    """(first line, name) of each function, after the type that it belongs to."""
    found, owner = [], ""
    for m in re.finditer(r"^impl.*?(\w+)(?:<[^<>]*>)? \{$|^\}$|\bfn (\w+)", text, re.M):
        if m.group(2):
            found.append((text.count("\n", 0, m.start()) + 1, owner + m.group(2)))
        else:
            owner = f"{m.group(1)}::" if m.group(1) else ""
    return found


def main():
    with tempfile.NamedTemporaryFile("r", suffix=".lcov") as report:
        subprocess.run(
            ["cargo", "llvm-cov", "-q", "-p", "dapple-conformance", "-p", "dapple-codec", "--test", "vectors", "--lcov", "--output-path", report.name],
            cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
        lines, file = {}, ""
        for line in report.read().splitlines():
            if line.startswith("SF:"):
                file = line[3:]
            elif line.startswith("DA:"):
                number, count = line[3:].split(",")[:2]
                lines.setdefault(file, {})[int(number)] = int(count)
    total = hit = 0
    missed = []
    for name in [*FILES, "container/crc.rs", "room.rs"]:
        path = ROOT / "codecs/src" / name
        text = path.read_text()
        source, places = text.splitlines(), functions(text)
        counted = {}
        for number, count in lines.get(str(path), {}).items():
            inside = [function for start, function in places if start <= number]
            if not inside or decodes(name, inside[-1]) and not CALLERS.search(inside[-1]):
                counted[number] = count
        covered = sum(count > 0 for count in counted.values())
        total, hit = total + len(counted), hit + covered
        print(f"{name:24} {covered:5} of {len(counted):5}  {100 * covered / max(len(counted), 1):6.1f} %")
        missed += [f"{name}:{number}: {source[number - 1].strip()}" for number, count in sorted(counted.items()) if not count]
    print(f"{'all':24} {hit:5} of {total:5}  {100 * hit / total:6.1f} %\n\nnot run:")
    print("\n".join(missed))


if __name__ == "__main__":
    main()
