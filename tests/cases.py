#!/usr/bin/env python3
"""Runs a folder of problem files through the program and checks what each must give.

    tests/cases.py FOLDER [--dapple PROGRAM] [--only TEXT]

The files are not part of the repository; each is known by the start of its name. Prints one line a
file and exits with 1 if any fails. Needs Python 3 alone.
"""

import argparse
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import zlib
from pathlib import Path

CHECKS = []  # (start of the name, function)


class Failed(Exception):
    """A file did not give what it must."""


def expect(condition, text):
    if not condition:
        raise Failed(text)


def case(*starts):
    """Registers a check of the files whose names start so."""

    def register(function):
        CHECKS.extend((start, function) for start in starts)
        return function

    return register


class Run:
    """The program in a folder of its own."""

    def __init__(self, program, folder):
        self.program = program
        self.folder = folder

    def dapple(self, *args, code=0, input=None):
        args = [str(a) for a in args]
        done = subprocess.run(
            [self.program, *args], cwd=self.folder, capture_output=True, input=input, timeout=600
        )
        line = "dapple " + " ".join(args)
        stderr = done.stderr.decode(errors="replace")
        if code is not None:
            expect(done.returncode == code, f"{line}: exit {done.returncode}: {stderr.strip()[-300:]}")
        expect("panicked" not in stderr, f"{line}: {stderr}")
        return done.stdout, stderr

    def encode(self, scene, *args):
        """Encodes into x.dapple; returns the report."""
        out, _ = self.dapple("encode", scene, "-o", "x.dapple", "--json", *args)
        self.dapple("validate", "x.dapple")
        return json.loads(out)

    def render(self, name, *args):
        """Renders a picture of 160x90."""
        self.dapple("render", *args, "--size", "160x90", "-o", name)
        return read_png(Path(self.folder) / name)

    def compare(self, a, b):
        out, _ = self.dapple("compare", a, b, "--json")
        return json.loads(out)


def read_png(path):
    """(width, height, rows of bytes a channel) of an 8-bit picture without interlacing."""
    data = path.read_bytes()
    at, packed = 8, b""
    while at < len(data):
        (size,) = struct.unpack(">I", data[at : at + 4])
        kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
        if kind == b"IDAT":
            packed += body
        at += 12 + size
    expect(depth == 8, f"{path.name}: 8 bits a channel")
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[colour]
    raw, stride = zlib.decompress(packed), width * channels
    rows, last = [], bytearray(stride)
    for y in range(height):
        kind, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        for x in range(stride):
            a = row[x - channels] if x >= channels else 0
            b, c = last[x], last[x - channels] if x >= channels else 0
            if kind == 1:
                row[x] = (row[x] + a) & 255
            elif kind == 2:
                row[x] = (row[x] + b) & 255
            elif kind == 3:
                row[x] = (row[x] + (a + b) // 2) & 255
            elif kind == 4:
                p = a + b - c
                near = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
                row[x] = (row[x] + near) & 255
        rows.append(bytes(row))
        last = row
    return width, height, channels, rows


def mean(picture):
    """Mean of the red, green and blue bytes."""
    _, _, channels, rows = picture
    used = [v for row in rows for i, v in enumerate(row) if channels < 3 or i % channels < 3]
    return sum(used) / len(used)


def largest_darkening(picture, reference):
    """Largest difference by which the picture is darker, 0 to 1, over means of 3x3 pixels."""
    width, height, channels, rows = picture
    worst = 0
    for y in range(1, height - 1):
        for x in range(1, width - 1):
            near = [(r, c * channels) for r in (y - 1, y, y + 1) for c in (x - 1, x, x + 1)]
            darker = sum(reference[3][r][c] - rows[r][c] for r, c in near) / 9
            worst = max(worst, darker)
    return worst / 255


EYE = ["--eye", "3,2.5,3.5", "--target", "0,0.3,0"]
FEW = ["--frames", "1", "--rays", "64"]


@case("json_", "one_bad_part_")
def is_read(run, path):
    report = run.encode(path, *FEW)
    is_read_whole = any(part in path.name for part in ("base64", "backslash", "webp"))
    if path.name.startswith("one_bad_part_") and not is_read_whole:
        expect(report["warnings"], "no warning names the part that was dropped")
    run.render("a.png", "x.dapple", "--scene", path)


@case("tex_")
def textures_cost_little(run, path):
    clock = time.monotonic()
    run.encode(path, *FEW, "--density", "64")
    run.render("a.png", "--method", "direct", "--scene", path)
    expect(time.monotonic() - clock < 60, "an image is decoded more than once")


@case("overwrite_")
def output_over_input_is_refused(run, path):
    scene = Path(run.folder) / "scene.glb"
    shutil.copy(path, scene)
    before = scene.read_bytes()
    os.symlink("scene.glb", Path(run.folder) / "link.glb")
    os.link(scene, Path(run.folder) / "hard.glb")
    for output in ("scene.glb", "./scene.glb", "link.glb", "hard.glb"):
        run.dapple("encode", "scene.glb", "-o", output, *FEW, code=2)
        run.dapple("render", "--method", "rtao", "--scene", "scene.glb", "-o", output, code=2)
        expect(scene.read_bytes() == before, f"{output}: the scene was harmed")
    run.dapple("encode", "scene.glb", "-o", "x.dapple", *FEW)
    stream = (Path(run.folder) / "x.dapple").read_bytes()
    run.dapple("render", "x.dapple", "--scene", "scene.glb", "-o", "x.dapple", code=2)
    expect((Path(run.folder) / "x.dapple").read_bytes() == stream, "the stream was harmed")


@case("anim_scale_", "anim_shown_")
def growing_objects_have_points(run, path):
    report = run.encode(path, "--fps", "5", "--rays", "256", "--threshold", "0", "--no-visibility")
    last = report["frames"] - 1
    ao = ["--scene", path, *EYE, "--frame", last, "--ao-only"]
    run.render("a.png", "x.dapple", *ao)
    run.render("b.png", "--method", "rtao", "--fps", "5", *ao, "--distance", report.get("distance", 0.6))
    psnr = run.compare("a.png", "b.png")["psnr"]
    expect(psnr > 40, f"{psnr:.1f} dB at full size")
    return f"{psnr:.1f} dB at full size"


@case("anim_two_clips_")
def clips_are_chosen(run, path):
    report = run.encode(path, "--frames", "2")
    expect(any("clip" in w or "animation" in w for w in report["warnings"]), "no line says which clips play")
    run.dapple("encode", path, "-o", "y.dapple", "--animation", "no such clip", code=1)


@case("two_scenes_")
def scenes_are_chosen(run, path):
    first = run.encode(path, *FEW)
    expect(any("was taken" in w for w in first["warnings"]), "no line says which scene was taken")
    second = run.encode(path, *FEW, "--scene", "1")
    expect(not any("was taken" in w for w in second["warnings"]), "a chosen scene needs no warning")
    expect(first["points"] != second["points"], "--scene has no effect")


@case("node_scale_zero_")
def flat_nodes_are_there(run, path):
    report = run.encode(path, *FEW)
    run.render("a.png", "--method", "rtao", "--ao-only", "--scene", path, *EYE)
    run.render("b.png", "x.dapple", "--ao-only", "--scene", path, *EYE)
    psnr = run.compare("a.png", "b.png")["psnr"]
    expect(report["points"] > 10_000 and psnr > 25, f"{report['points']} points, {psnr} dB")
    return f"{report['points']} points, {psnr:.1f} dB"


@case("ao_decal_")
def decals_do_not_darken_their_edges(run, path):
    report = run.encode(path, "--frames", "1", "--rays", "512")
    view = ["--scene", path, "--ao-only", "--eye", "1.1,1.5,2.6", "--target", "1.1,0,1.1"]
    got = run.render("a.png", "x.dapple", *view)
    right = run.render("b.png", "--method", "rtao", *view, "--distance", report.get("distance", 0.6))
    worst = largest_darkening(got, right)
    expect(worst <= 0.1, f"darker by {worst:.2f}")
    return f"darker by at most {worst:.2f}"


@case("blend_")
def opaque_blend_has_points(run, path):
    report = run.encode(path, *FEW)
    expect(report["points"] > 1000, f"{report['points']} points")
    ao = run.render("a.png", "--method", "rtao", "--ao-only", "--scene", path, *EYE)
    expect(mean(ao) < 254, "casts no AO")


def path_mean(run, name, path, *args):
    view = ["--eye", "0,1.5,-1.8", "--target", "0,1.2,2", "--exposure", "1"]
    return mean(run.render(name, "--method", "path", "--samples", "64", "--scene", path, *view, *args))


@case("gi_transmission_")
def windows_let_light_in(run, path):
    sky = ["--sky", "2,2,2"]
    got = path_mean(run, "a.png", path, *sky)
    right = path_mean(run, "b.png", path.with_name("gi_window_open_reference.glb"), *sky)
    expect(0.75 * right < got < 1.02 * right, f"{got:.1f} grey where the open window gives {right:.1f}")
    return f"{got:.1f} grey; open {right:.1f}"


@case("gi_vertex_colour_")
def vertex_colours_multiply(run, path):
    got = path_mean(run, "a.png", path)
    right = path_mean(run, "b.png", path.with_name("gi_red_by_factor_reference.glb"))
    expect(abs(got - right) < 1, f"{got:.1f}, not {right:.1f}")


@case("gi_red_", "gi_window_")
def references_are_read(run, path):
    path_mean(run, "a.png", path)


@case("gi_emissive_texture_")
def emissive_texels_glow(run, path):
    view = ["--eye", "1.5,1.5,0", "--target=-2,1.5,0", "--exposure", "1"]
    _, _, channels, rows = run.render("a.png", "--method", "path", "--samples", "64", "--scene", path, *view)
    pixels = [v for row in rows for v in row[::channels]]
    bright = sum(v > 160 for v in pixels) / len(pixels)
    expect(0.02 < bright < 0.25, f"{bright:.2f} of the picture glows")
    return f"{bright:.2f} of the picture glows"


@case("gi_unlit_")
def unlit_light_nothing(run, path):
    _, stderr = run.dapple("render", "--method", "path", "--scene", path, "--size", "32x18", "--samples", "4", "-o", "a.png")
    if "unlit" in stderr:
        return "warned"
    lit = path_mean(run, "a.png", path)
    right = path_mean(run, "b.png", path.with_name("gi_red_by_factor_reference.glb"))
    return f"no warning; {lit:.1f} grey, lit walls {right:.1f}"


@case("gi_lamp_")
def lamps_in_a_ceiling_agree(run, path):
    view = ["--eye", "0,1.5,-1.8", "--target", "0,1.2,2", "--exposure", "1", "--scene", path]
    run.encode(path, "--model", "probes", "--frames", "1", "--probes", "8x6x8")
    figures = {
        "path": mean(run.render("a.png", "--method", "path", "--samples", "128", *view)),
        "probes": mean(run.render("b.png", "x.dapple", "--method", "probes", *view)),
    }
    low, high = min(figures.values()), max(figures.values())
    expect(low > 0.85 * high, f"{figures}")
    return str({name: round(value, 1) for name, value in figures.items()})


@case("uv_normal_map_on_set1_reads_set0", "uv_normal_map_on_set1_reference")
def normal_maps_use_their_set(run, path):
    view = ["--method", "rtao", "--ao-only", *EYE]
    a = run.render("a.png", "--scene", path.with_name("uv_normal_map_on_set1_reads_set0.glb"), *view)
    b = run.render("b.png", "--scene", path.with_name("uv_normal_map_on_set1_reference.glb"), *view)
    psnr = run.compare("a.png", "b.png")["psnr"]
    expect(psnr is None or psnr > 40, f"{psnr} dB between the twins")
    return f"means {mean(a):.1f} and {mean(b):.1f}"


@case("unit_", "far_")
def units_and_places_fit(run, path):
    report = run.encode(path, "--frames", "1")
    ao = ["--scene", path, "--ao-only"]
    got = run.render("a.png", "x.dapple", *ao)
    run.render("b.png", "--method", "rtao", *ao, "--distance", report["distance"])
    psnr = run.compare("a.png", "b.png")["psnr"]
    expect(report["points"] > 1000 and mean(got) < 254, f"{report['points']} points, mean {mean(got):.1f}")
    expect(psnr > 30, f"{psnr} dB")
    return f"{report['points']} points, {report['distance']:.3g} m, {psnr:.1f} dB"


@case("draco_")
def draco_is_named(run, path):
    _, stderr = run.dapple("encode", path, "-o", "x.dapple", *FEW, code=None)
    expect("raco" in stderr, stderr)


@case("probes_static_bake_")
def rooms_stay_dark(run, path):
    run.encode(path, "--model", "probes", "--frames", "10", "--keyframe-interval", "8", "--fps", "10")
    view = ["--scene", path, "--camera", "dark"]
    right = mean(run.render("p.png", "--method", "path", "--samples", "64", *view))
    means = [mean(run.render("a.png", "x.dapple", "--method", "probes", *view, "--frame", k)) for k in range(10)]
    expect(max(means) - min(means) < 3, f"flashes: {[round(m, 1) for m in means]}")
    return f"{min(means):.1f} to {max(means):.1f} grey; path tracing {right:.1f}"


# Streams and hierarchies.


def cpu_seconds(run, *args, code=0):
    before = os.times()
    run.dapple(*args, code=code)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


@case("fill_2_frames", "remove_65536", "state512")
def hostile_streams_cost_little(run, path):
    seconds = cpu_seconds(run, "validate", path, code=None)
    expect(seconds < 2, f"{seconds:.1f} s of CPU")
    return f"{seconds:.2f} s of CPU"


@case("deep40x30")
def written_streams_open(run, path):
    _, stderr = run.dapple("encode", path, "-o", "x.dapple", *FEW, code=None)
    if (Path(run.folder) / "x.dapple").exists():
        run.dapple("validate", "x.dapple")
        return "opens"
    expect(len(stderr.strip().splitlines()) == 1, stderr)
    return "refused"


@case("v2")
def newer_versions_are_named(run, path):
    _, stderr = run.dapple("validate", path, code=1)
    out, _ = run.dapple("validate", path, "--json", code=1)
    text = stderr + out.decode()
    expect("version" in text and "2" in text and "damaged" not in text, text)
    out, stderr = run.dapple("inspect", path, code=None)
    text = stderr + out.decode()
    expect("damaged" not in text and "newer" in text, text)


@case("sk_unk_crit", "sk_model3")
def unknown_things_are_named(run, path):
    out, stderr = run.dapple("validate", path, code=1)
    text = (stderr + out.decode()).strip()
    expect(any(c.isdigit() for c in text.replace(path.name, "")), text)
    return text.replace(str(path), path.name).replace("\n", " ")[:150]


@case("join")
def joined_streams_show_frames(run, path):
    out, _ = run.dapple("decode", path, "--join", "--dump", code=None)
    frames = sum(line.startswith("frame ") for line in out.decode().splitlines())
    expect(frames == 20, f"{frames} frames")


@case("loss")
def lost_records_cost_few_frames(run, path):
    out, _ = run.dapple("decode", path, "--resume", "--dump", code=None)
    frames = sum(line.startswith("frame ") for line in out.decode().splitlines())
    expect(frames >= 22, f"{frames} frames")


@case("G2-ff-")
def streams_have_one_outcome(run, path):
    here = Path(__file__).resolve().parent.parent
    out, _ = run.dapple("validate", path, "--json", code=None)
    python = subprocess.run(
        [here / "conformance/decoders/python/run.sh", path], capture_output=True, timeout=300
    )
    ours = run.dapple("decode", path, "--dump", code=None)[0]
    return f"{'same dump' if python.stdout == ours else 'see by hand'}: {json.loads(out)}"[:150]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--dapple", default="target/release/dapple", type=Path)
    parser.add_argument("--only", default="", help="files whose names contain this text")
    args = parser.parse_args()
    files = sorted(p for p in args.folder.resolve().iterdir() if p.is_file() and p.suffix != ".md")
    failed = 0
    for path in files:
        if args.only not in path.name:
            continue
        check = max((c for c in CHECKS if path.name.startswith(c[0])), key=lambda c: len(c[0]), default=None)
        if check is None:
            print(f"??    {path.name}: no check is known")
            continue
        with tempfile.TemporaryDirectory() as folder:
            try:
                note = check[1](Run(args.dapple.resolve(), folder), path)
                print(f"ok    {path.name}{': ' + note if note else ''}", flush=True)
            except (Failed, subprocess.TimeoutExpired, KeyError) as error:
                failed += 1
                print(f"FAIL  {path.name}: {error}", flush=True)
    print(f"{failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
