#!/bin/sh
# From a bare Debian 12 to a picture: installs what is needed, builds, converts a model, renders it.
# usage: examples/quickstart.sh [MODEL]       MODEL: a STEP, IGES or BREP file, also as .zst; default: a small board
set -eu

cd "$(dirname "$0")/.."
model=${1:-examples/stamp_s3.step.zst}
case $model in
    /*) ;;
    *) [ -e "$model" ] || model=${OLDPWD:-.}/$model ;; # named from where the script was called
esac
[ -r "$model" ] || { echo "quickstart: $model: not found; name a STEP, IGES or BREP file" >&2; exit 2; }

say() { printf '\n== %s\n' "$*" >&2; }

say "Packages (from packages.txt)"
packages=$(grep -v '\[test\]' packages.txt | sed 's/#.*//' | tr -s ' \n' ' ')
missing=
for package in $packages; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing="$missing $package"
done
if [ -n "$missing" ]; then
    as_root=
    [ "$(id -u)" = 0 ] || as_root=sudo
    $as_root apt-get update
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $missing
fi

say "Build (Release, without tests and viewer)"
cmake -S . -B build-quickstart -G Ninja -DCMAKE_BUILD_TYPE=Release -DTRIMRAY_TESTS=OFF -DTRIMRAY_VIEWER=OFF
cmake --build build-quickstart --target trimray trimray-pack

say "Convert $model"
name=$(basename "${model%.zst}")
pack=build-quickstart/${name%.*}.tray
picture=build-quickstart/${name%.*}.png
status=0
build-quickstart/bin/trimray pack "$model" -o "$pack" || status=$?
[ "$status" = 0 ] || [ "$status" = 6 ] || exit "$status" # 6: done, but some faces were dropped and named

say "Render"
build-quickstart/bin/trimray render "$pack" -o "$picture" --size 1600x1000 --samples 2 --background white
say "Done. The pack: $PWD/$pack   The picture: $PWD/$picture"
