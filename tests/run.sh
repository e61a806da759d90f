#!/usr/bin/env bash
# Builds Color3D and runs its tests. Installs missing packages (as root or with sudo).
#   tests/run.sh             checks of the sources, then the default suite: all tests but those with
#                            the labels slow, long, chaos, soak, load and fuzz
#   tests/run.sh -L LABEL    only the tests with this label (tests/README.md lists them); fuzz: in a
#                            Clang build of its own
#   tests/run.sh -R NAME     builds and runs only the test programs, suites or cases that match the
#                            regular expression
#   tests/run.sh --changed [REV]
#                            builds and runs only the quick test programs of the folders that changed
#                            since REV (default: since this branch left main)
# BUILD_DIR: build folder (default: build; build-fuzz for the label fuzz). CI=true: no questions, no
# colours.
set -euo pipefail
cd "$(dirname "$0")/.."

label="" name="" changed="" since=""
case "${1:-}" in
  "") ;;
  -L) label=${2:?"-L needs a label"} ;;
  -R) name=${2:?"-R needs a regular expression"} ;;
  --changed) changed=1 since=${2:-} ;;
  -h | --help) sed -n '2,15p' "$0" | cut -c3-; exit 0 ;;
  *) echo "run.sh: unknown option $1; see tests/run.sh --help" >&2; exit 2 ;;
esac

# A label or name that matches no test is an error.
run_tests() {
  local result=0
  ctest --test-dir "$build" --output-on-failure --no-tests=error --timeout 900 "$@" || result=$?
  # Lists skipped cases, since a program passes in spite of them.
  grep -hE '^\[  SKIPPED \] .*\(' "$build/Testing/Temporary/LastTest.log" | sort -u || true
  return "$result"
}
configure() {
  cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCOLOR3D_TESTS=ON
}

if [ "$label" = fuzz ]; then
  build=${BUILD_DIR:-build-fuzz}
  deploy/install-deps.sh --fuzz
  cmake -S . -B "$build" -G Ninja -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ \
    -DCOLOR3D_FUZZ=ON -DCOLOR3D_WERROR=OFF
  cmake --build "$build" --target fuzz_targets
  run_tests -L '^fuzz$'
  exit
fi

build=${BUILD_DIR:-build}
deploy/install-deps.sh --tests
case "$label" in
  slow) deploy/install-deps.sh --engines ;;
  long) npm install --prefix tests/.npm --no-audit --no-fund --loglevel=error s3rver >/dev/null ||
    echo "run.sh: npm could not install s3rver; its cases are skipped" >&2 ;;
esac
if [ -n "$name$changed" ]; then
  configure
  if [ -n "$name" ]; then
    targets=$(tests/test_targets.py "$build" --name "$name")
  else
    targets=$(tests/test_targets.py "$build" --changed "$since")
  fi
  [ -n "$targets" ] || { echo "run.sh: no test program matches" >&2; exit 1; }
  # shellcheck disable=SC2086
  cmake --build "$build" --target $targets
  # Tests of these programs: a fast program is one test of its name, others have one test per case.
  programs="^($(for program in $targets; do
    echo "$program\$"
    "$build/bin/$program" --gtest_list_tests | sed -nE 's|^([A-Za-z0-9_/]+\.)$|\1|p'
  done | sort -u | paste -sd'|'))"
  if [ -n "$changed" ]; then
    run_tests -j 2 -R "$programs" -L '^(fast|stability)$'
  elif grep -qE -e "$name" <<<"$targets"; then
    run_tests -R "$programs"
  else  # matches cases; a fast program is one test, run whole
    run_tests -R "$name|^($(paste -sd'|' <<<"$targets"))\$"
  fi
  exit
fi

tests/check_format.sh
tests/check_layers.sh
tests/check_docs.sh
tests/test_targets.py --check-long
tests/check_proto.sh "$build"
configure
cmake --build "$build"
tests/check_includes.sh "$build"
tests/check_tidy.sh "$build"
tests/check_thread_safety.sh "$build"
if [ -n "$label" ]; then
  run_tests -L "^$label\$"
else
  # Quick programs run in pairs; others use every core and run one at a time.
  run_tests -j 2 -L "^(fast|stability)\$"
  run_tests -LE "^(fast|stability|slow|long|chaos|soak|load)\$"
fi
