#!/usr/bin/env bash
# Builds Color3D and runs its tests. Installs what is missing (as root or with sudo).
#   tests/run.sh              all gates, then the default suite: every test but those labelled slow, long,
#                             chaos, soak and load
#   tests/run.sh -L LABEL     all gates, then the tests with this label (tests/README.md lists them)
#   tests/run.sh -R NAME      no gates: builds and runs the test programs that NAME, a regular expression,
#                             matches; if there is none, the cases "Suite.Case" that it matches
#   tests/run.sh --changed    quick gates, then the default tests of the folders that differ from the
#                             branch main (on main: from the commit before)
# -L fuzz builds with Clang in a folder of its own. BUILD_DIR names another build folder (default: build;
# build-fuzz for -L fuzz). With CI=true nothing is asked or coloured.
set -euo pipefail
cd "$(dirname "$0")/.."

usage() { sed -n '2,11p' "$0" | cut -c3-; }
label="" name="" changed=""
while [ $# -gt 0 ]; do
  case "$1" in
    -L | -R)
      [ $# -ge 2 ] || { usage >&2; exit 2; }
      if [ "$1" = -L ]; then label=$2; else name=$2; fi
      shift
      ;;
    --changed) changed=yes ;;
    -h | --help) usage; exit 0 ;;
    *) usage >&2; exit 2 ;;
  esac
  shift
done
not_default="slow|long|chaos|soak|load"

# A label without a test is an error. Tests that use every core run alone (RUN_SERIAL).
run_tests() {
  local result=0
  ctest --test-dir "$build" -j2 --output-on-failure --no-tests=error --timeout 900 "$@" || result=$?
  # Programs of many cases pass though some were skipped.
  grep -hE '^\[  SKIPPED \] .*\(' "$build/Testing/Temporary/LastTest.log" | sort -u || true
  return "$result"
}

configure() {
  mkdir -p "$build"
  cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCOLOR3D_TESTS=ON >"$build/configure.log" || {
    cat "$build/configure.log" >&2
    return 1
  }
}

# "PROGRAM SOURCE" for each source of each test program, from Ninja's rules and CMake's unity files.
test_sources() {
  {
    sed -nE 's|^build .*CMakeFiles/([A-Za-z0-9_]+(_test\|_replay\|_canary))\.dir/[^ ]*\.o: [^ ]+ ([^ ]+\.cc) .*|\1 \3|p' \
      "$build/build.ninja"
    find "$build" -path '*_test.dir/Unity/*.cxx' -exec grep -H '^#include' {} + |
      sed -nE 's|.*/([A-Za-z0-9_]+)\.dir/Unity/[^:]*:#include "([^"]+)".*|\1 \2|p'
  } | sed -E "s| $PWD/| |; s| \.\./| |" | sort -u
}

# Builds the programs named on standard input and runs their tests with the given CTest options.
build_and_run() {
  local programs all
  mapfile -t programs
  cmake --build "$build" --target "${programs[@]}"
  # A program of cases has the tests that it lists; a fast one has one test of its own name.
  all=$(for program in "${programs[@]}"; do
    echo "$program"
    "$build/bin/$program" --gtest_list_tests 2>/dev/null | sed -nE 's|^([A-Za-z0-9_]+)\.$|\1\\..*|p' || true
  done | sort -u | paste -sd'|')
  run_tests -R "^($all)\$" "$@"
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
if [ -n "$name" ]; then
  configure
  programs=$(test_sources | cut -d' ' -f1 | sort -u | grep -E -e "$name" || true)
  if [ -n "$programs" ]; then
    build_and_run <<<"$programs"
    exit
  fi
  programs=$(test_sources | while read -r program source; do
    if sed -nE 's/^TEST(_F|_P)?\((\w+), *(\w+)\).*/\2.\3/p' "$source" | grep -qE -e "$name"; then
      echo "$program"
    fi
  done | sort -u)
  if [ -z "$programs" ]; then
    echo "run.sh: no test program and no case matches \"$name\"" >&2
    exit 1
  fi
  # shellcheck disable=SC2086 # the programs are words
  cmake --build "$build" --target $programs
  for program in $programs; do
    # Only the matching cases, also of a program that CTest runs as one test.
    cases=$("$build/bin/$program" --gtest_list_tests | awk '/^[^ ]/ {suite = $1; next} {print suite $1}' |
      grep -E -e "$name" | paste -sd:)
    OMP_WAIT_POLICY=PASSIVE "$build/bin/$program" --gtest_filter="$cases"
  done
  exit
fi

if [ -n "$changed" ]; then
  configure
  base=$(git merge-base HEAD main 2>/dev/null || git rev-parse HEAD)
  if [ "$base" = "$(git rev-parse HEAD)" ] && git diff --quiet HEAD; then
    base=$(git rev-parse HEAD~1)
  fi
  tests/check_format.sh
  tests/check_layers.sh
  tests/check_docs.sh
  folders=$({ git diff --name-only "$base"; git ls-files --others --exclude-standard; } | xargs -r -n1 dirname | sort -u)
  programs=$(test_sources | while read -r program source; do
    if grep -qxF "$(dirname "$source")" <<<"$folders"; then echo "$program"; fi
  done | sort -u)
  if [ -z "$programs" ]; then
    echo "run.sh: no test program has sources in the changed folders:" ${folders:-none}
    exit
  fi
  echo "run.sh: tests of the changed folders:" $programs "(without the labels $not_default)"
  build_and_run -LE "^($not_default)\$" <<<"$programs"
  exit
fi

deploy/install-deps.sh --tests
tests/check_format.sh
tests/check_layers.sh
tests/check_docs.sh
tests/check_proto.sh "$build"
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCOLOR3D_TESTS=ON
cmake --build "$build"
tests/check_includes.sh "$build"
tests/check_tidy.sh "$build"
tests/check_thread_safety.sh "$build"
if [ -n "$label" ]; then
  run_tests -L "^($label)\$"
else
  run_tests -LE "^($not_default)\$"
fi
