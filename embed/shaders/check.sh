#!/usr/bin/env bash
# Compiles the generated GLSL and HLSL with glslang: each file alone, with its accessors brought from outside, and
# all models of a folder in one shader. Validates the SPIR-V. Installs the two where they are missing and where it
# may. MSL has no compiler outside Apple's systems, and Debian has no DXC: neither is checked.
set -euo pipefail
cd "$(dirname "$0")"

if ! command -v glslangValidator spirv-val >/dev/null; then
    if command -v apt-get >/dev/null && [ "$(id -u)" = 0 ]; then
        apt-get update -qq
        apt-get install -y -qq --no-install-recommends glslang-tools spirv-tools
    else
        echo "skipped: glslang-tools and spirv-tools are not installed" >&2
        exit 0
    fi
fi

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
compiled=0

compile() { # TEXT NAME OPTIONS...
    local log="$folder/log"
    printf '%s\n' "$1" >"$folder/shader.frag"
    if ! glslangValidator "${@:3}" -S frag "$folder/shader.frag" >"$log"; then
        echo "$2:" >&2
        cat "$log" >&2
        exit 1
    fi
    compiled=$((compiled + 1))
}

spirv() { # TEXT NAME OPTIONS...
    compile "$@" -o "$folder/shader.spv"
    spirv-val "$folder/shader.spv"
}

glsl() { # FOLDER VERSION FILES...
    local text=$'#version '"$2"$'\nprecision highp float;\nprecision highp int;\n'
    text+=$(cat "${@:3}")$'\nvoid main() {}'
    compile "$text" "${*:3}"
    if [ "$1" = glsl450 ]; then
        spirv "$text" "${*:3}" -V
    fi
}

hlsl() { # FOLDER - FILES...
    local text
    text=$(cat "${@:3}")$'\nfloat4 main() : SV_Target { return float4(0, 0, 0, 0); }'
    # Storage buffers of HLSL are typed in SPIR-V by a rule of scalar layout.
    spirv "$text" "${*:3}" -D -V -e main --hlsl-offsets
}

# The file with its own accessors brought from outside, behind it.
custom() { # FILE
    printf '#define DAPPLE_%s_CUSTOM\n' "$(basename "${1%%_*}" | tr '[:lower:]' '[:upper:]')"
    cat "$1"
    sed -n '/^#ifndef/,/^#else/p' "$1" | grep -v '^#'
}

each() { # LANGUAGE FOLDER VERSION
    local accessor file files
    for accessor in buffers textures packed; do
        files=()
        for file in "$2"/*_"$accessor".*; do
            [ -e "$file" ] || continue
            "$1" "$2" "$3" "$file"
            custom "$file" >"$folder/$accessor"
            "$1" "$2" "$3" "$folder/$accessor"
            files+=("$file")
        done
        [ ${#files[@]} = 0 ] || "$1" "$2" "$3" "${files[@]}"
    done
}

each glsl glsl450 450
each glsl glsl310es "310 es"
each glsl glsl300es "300 es"
each hlsl hlsl -

# Accessors of an engine's own in place of those of the files; registers are numbered by the compiler.
for file in engines/*.hlsl; do
    text=$(glslangValidator -E -D -S frag "$file" | grep -v '^#line')
    spirv "$text"$'\nfloat4 main() : SV_Target { return float4(0, 0, 0, 0); }' "$file" -D -V -e main --hlsl-offsets --amb
done
[ "$compiled" -ge 100 ] || { echo "only $compiled shaders were compiled" >&2; exit 1; }
echo "glslang compiled $compiled shaders"
