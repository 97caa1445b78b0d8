#!/bin/sh
# Installs what building and testing needs on Debian 12, builds, and passes all tests; then the tests of the format,
# the runtime, the viewer and the reading of model files once more under the address and undefined-behaviour
# sanitizers.
# usage: [TRIMRAY_TEST_ENGINES=1] tests/run.sh    (1: installs what tests/engines.txt names as well)
# The last line is `N passed, N failed`; the exit code is 0 only when nothing failed.
set -eu
cd "$(dirname "$0")/.."

say() { printf '\n== %s\n' "$*"; }
jobs=${TRIMRAY_JOBS:-$(nproc)}

say "Packages (from packages.txt)"
lists=packages.txt
[ "${TRIMRAY_TEST_ENGINES:-0}" = 0 ] || lists="$lists tests/engines.txt"
missing=
for package in $(cat $lists | sed 's/#.*//'); do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing="$missing $package"
done
if [ -n "$missing" ]; then
    as_root=
    [ "$(id -u)" = 0 ] || as_root=sudo
    $as_root apt-get update -q
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $missing
fi

say "Formatting (clang-format 14)"
find format preprocess runtime shaders tests examples -name '*.h' -o -name '*.cpp' 2>/dev/null |
    xargs clang-format --dry-run --Werror
echo "every source is formatted"

say "Build, all of it"
cmake --preset release
cmake --build build -j "$jobs"

passed=0
failed=0
# Runs the tests of a build folder and adds up what ctest counts. $1: folder, then more arguments for ctest
count_tests() {
    folder=$1
    shift
    log=$folder/tests.log
    ctest --test-dir "$folder" -j "$jobs" --output-on-failure "$@" >"$log" 2>&1 || true
    cat "$log"
    # "97% tests passed, 2 tests failed out of 70"; skipped tests count as neither
    total=$(sed -n 's/.*tests failed out of \([0-9]*\).*/\1/p' "$log" | tail -1)
    bad=$(sed -n 's/.*tests passed, \([0-9]*\) tests failed.*/\1/p' "$log" | tail -1)
    skipped=$(grep -c '\*\*\*Skipped' "$log" || true)
    if [ -z "$total" ] || [ "$total" = 0 ]; then
        echo "no test ran in $folder"
        failed=$((failed + 1))
        return
    fi
    passed=$((passed + total - bad - skipped))
    failed=$((failed + bad))
}

say "Tests"
count_tests build

say "Sanitizers: format, runtime, viewer, model files"
cmake --preset sanitize -DTRIMRAY_PREPROCESS=OFF
cmake --build build-sanitize -j "$jobs"
count_tests build-sanitize

say "Done"
echo "$passed passed, $failed failed"
[ "$failed" = 0 ]
