#!/bin/sh
# Runs the decoder; makes a virtual environment with its packages first, where they are missing.
here=$(cd "$(dirname "$0")" && pwd)
python=python3
if ! python3 -c 'import lz4.block, zstandard' 2>/dev/null; then
    environment=$here/../../../target/python
    python=$environment/bin/python
    if ! [ -e "$environment/ready" ]; then
        python3 -m venv "$environment" >&2 &&
            "$python" -m pip install --quiet --disable-pip-version-check -r "$here/requirements.txt" >&2 &&
            touch "$environment/ready" || exit 70
    fi
fi
exec "$python" "$here/decoder.py" "$@"
