#!/usr/bin/env python3
"""Changes the decoder's source in one place at a time and runs the conformance vectors, and nothing
else, against each: whatever change they do not notice is a check that they do not hold.

    conformance/mutate.py [--work DIR] [--only TEXT] [--list FILE] [--share K/N]

Mutants come from `cargo mutants --list` (operators, values, match arms; install cargo-mutants) and
from two rules of our own: an `if` that ends in an error never does, and the error of a `...?;`
statement is ignored. Results go to DIR/results.tsv, one line a mutant: caught, MISSED, loops
(caught by the clock) or unbuildable; a second run goes on where the first stopped. Those that are
missed and are no faults of a decoder stand in conformance/mutants.txt with the reason; any other
makes the exit status 1."""

import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Modules of the decoder, those that check first.
FILES = """points/check.rs points/decode.rs points/sections.rs points/parameters.rs content.rs frame.rs model.rs
parts.rs records.rs session.rs track.rs transforms.rs
decoder/steps.rs container/header.rs container/preamble.rs container/unpack.rs container/zstd.rs
container/lz4.rs points/mod.rs wire.rs
decoder.rs points/hash.rs points/state.rs ranges.rs
probes/parameters.rs probes/decode.rs probes/packed.rs probes/raw.rs entropy.rs probes/values.rs
probes/f16.rs probes/contexts.rs probes/fill.rs probes/state.rs probes/mod.rs
digest.rs probes/digest.rs""".split()
# What is the encoder's, builds only without `std`, or tells the caller what no dump shows.
OTHER = re.compile(r"""\b(Writer.*|write(_\w+)?|put_\w+|pad4|to_bytes|fmt|hz|zstd_portable|decode_blocks|check_sections
|portable|unpack_zstd_twice|tick_rate|last_frame|transforms_dirty|clear_dirty|heap_bytes|name
|check_probe|coding_number|f16_from_f32|f32_from_f16|round|cut|index|StateDigest::volume|(visibility_)?dirty_of|touch)$""".replace("\n", ""))
SECONDS = 40


def decodes(file, function):
    """Whether a function is the decoder's. The `write` of two files is: it fills the state."""
    return file.endswith(("points/sections.rs", "probes/fill.rs")) or not OTHER.search(function)


def cargo_mutants(files):
    """(name, file, start, end, replacement) with offsets in characters."""
    listed = subprocess.run(["cargo", "mutants", "--list", "--json", "-p", "dapple-codec"], cwd=ROOT, capture_output=True, check=True)
    for mutant in json.loads(listed.stdout):
        file = mutant["file"]
        if file not in files or not decodes(file, (mutant["function"] or {}).get("function_name", "")):
            continue
        lines = files[file].splitlines(keepends=True)

        def offset(place):
            return sum(map(len, lines[: place["line"] - 1])) + place["column"] - 1

        start, end = offset(mutant["span"]["start"]), offset(mutant["span"]["end"])
        yield mutant["name"], file, start, end, mutant["replacement"]


def left_out_checks(files):
    """Mutants of our own two rules."""
    for file, text in files.items():
        tests = text.find("#[cfg(all(test")
        body = text if tests < 0 else text[:tests]
        functions = [(m.start(), m.group(1)) for m in re.finditer(r"\bfn (\w+)", body)]

        def place(at):
            inside = [name for start, name in functions if start <= at]
            return text.count("\n", 0, at) + 1, inside[-1] if inside else ""

        condition = r"\bif ((?:[^][{};]|\[[^][{}]*\])+?) "
        refusals = [("false &&", found) for found in re.finditer(condition + r"(?:\{\s*|=> )return Err\(([\w:]*)", body)]
        refusals += [("true ||", found) for found in re.finditer(condition + r"\{\s*Ok\(\(\)\)\s*\} else \{\s*Err\(([\w:]*)", body)]
        for never, found in refusals:
            line, function = place(found.start())
            if decodes(file, function) and not found.group(1).startswith("let "):
                start, end = found.span(1)
                yield f"{file}:{line}: never refuse {found.group(2)} in {function}", file, start, end, f"{never} ({found.group(1)})"
        for found in re.finditer(r"(?<=[;{}]\n)( *)([a-z][^;{}=]*)\?;\n", body):
            line, function = place(found.start(2))
            if decodes(file, function) and not found.group(2).startswith("let "):
                start, end = found.span(2)
                yield f"{file}:{line}: ignore {' '.join(found.group(2).split('(')[0].split())} in {function}", file, start, end + 1, f"let _ = {found.group(2)}"


def run(tree, target):
    """caught, MISSED, loops or unbuildable."""
    build = subprocess.run(
        ["cargo", "test", "--offline", "--profile", "mutants", "-p", "dapple-conformance", "--no-default-features", "--test", "vectors", "--no-run", "--message-format", "json"],
        cwd=tree, env={**os.environ, "CARGO_TARGET_DIR": str(target), "RUSTFLAGS": "-Awarnings"}, capture_output=True)
    if build.returncode:
        return "unbuildable"
    messages = [json.loads(line) for line in build.stdout.splitlines() if line.startswith(b"{")]
    binary = [m["executable"] for m in messages if m.get("executable") and m["target"]["name"] == "vectors"][-1]
    # The vectors themselves are enough for most; what they miss, prefixes and flips may catch.
    for name in "our_decoder_passes_every_vector", "our_decoder_passes_their_prefixes_and_flips":
        try:
            test = subprocess.run([binary, "--exact", name], cwd=tree / "conformance", capture_output=True, timeout=SECONDS)
        except subprocess.TimeoutExpired:
            return "loops"
        if test.returncode:
            return "caught"
    return "MISSED"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--work", type=pathlib.Path, default=ROOT / "target" / "mutate")
    parser.add_argument("--only", default="", help="mutants whose name holds this")
    parser.add_argument("--list", type=pathlib.Path, help="a file of names, one a line")
    parser.add_argument("--share", default="0/1", help="the K-th of N shares")
    arguments = parser.parse_args()
    share, shares = map(int, arguments.share.split("/"))
    names = {line.split("\t")[0] for line in arguments.list.read_text().splitlines()} if arguments.list else None
    files = {f"codecs/src/{name}": (ROOT / "codecs/src" / name).read_text() for name in FILES}
    mutants = [*left_out_checks(files), *sorted(cargo_mutants(files), key=lambda mutant: list(files).index(mutant[1]))]
    mutants = [m for i, m in enumerate(mutants) if i % shares == share and arguments.only in m[0] and (names is None or m[0] in names)]

    work = arguments.work / f"share{share}of{shares}"
    tree = work / "tree"
    shutil.rmtree(tree, ignore_errors=True)
    shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns("target", ".git", "corpus", "fuzz"))
    for file in files:  # newer than what a run that was stopped may have built
        (tree / file).touch()
    results = work / "results.tsv"
    done = {line.split("\t")[0] for line in results.read_text().splitlines()} if results.exists() else set()
    if run(tree, work / "target") != "MISSED":
        sys.exit("the vectors do not pass as it is")
    print(f"{len(mutants)} mutants, {len(done)} done before", flush=True)
    with results.open("a") as out:
        for name, file, start, end, replacement in mutants:
            if name in done:
                continue
            path = tree / file
            path.write_text(files[file][:start] + replacement + files[file][end:])
            result = run(tree, work / "target")
            path.write_text(files[file])
            print(f"{name}\t{result}", file=out, flush=True)
    explained = [line.split("\t")[0] for line in (ROOT / "conformance/mutants.txt").read_text().splitlines() if "\t" in line]
    counts, open_ones = {}, 0
    for line in results.read_text().splitlines():
        name, result = line.split("\t")
        if result == "MISSED":
            # Line numbers are not part of a reason.
            plain = re.sub(r":\d+(:\d+)?", "", name)
            if any(part in plain for part in explained):
                result = "explained"
            else:
                open_ones += 1
                print(f"MISSED {name}")
        counts[result] = counts.get(result, 0) + 1
    print(counts)
    sys.exit(open_ones > 0)


if __name__ == "__main__":
    main()
