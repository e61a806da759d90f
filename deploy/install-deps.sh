#!/usr/bin/env bash
# Installs the packages to build and run Color3D on Debian 12 (or a later Debian or Ubuntu that has the
# same packages). Run as root or as a user with sudo; does nothing if all are installed.
#   deploy/install-deps.sh           packages of deploy/demo.sh
#   deploy/install-deps.sh --tests   and those of tests/run.sh
#   deploy/install-deps.sh --fuzz    and those of tests/run.sh -L fuzz
#   deploy/install-deps.sh --engines and those of the tests of deploy/slurm and deploy/kubernetes
set -euo pipefail

packages=(
  build-essential cmake ninja-build ccache mold pkg-config git ca-certificates
  libtorch-dev libopenblas0-pthread # without the latter LibTorch multiplies matrices 30 times slower
  libgrpc++-dev protobuf-compiler protobuf-compiler-grpc libprotobuf-dev libabsl-dev
  libopencv-dev libeigen3-dev colmap
  libsqlite3-dev libpqxx-dev libssl-dev libspdlog-dev libfmt-dev libcli11-dev nlohmann-json3-dev libhwy-dev
  prometheus-cpp-dev libcurl4-openssl-dev libcpp-httplib-dev
  libicu-dev libnanoflann-dev zlib1g-dev libwebp-dev liblcms2-dev libzstd-dev libseccomp-dev
  libavcodec-dev libavformat-dev libavutil-dev libswscale-dev # film
)
case "${1:-}" in
  "") ;;
  --tests) packages+=(libgtest-dev libgmock-dev libbenchmark-dev clang-format clang-tidy faketime iproute2 prometheus postgresql-15 systemd
    python3-grpcio python3-protobuf python3-numpy python3-pil
    python3-venv python3-setuptools python3-wheel mypy python3-yaml) ;;
  --fuzz) packages+=(libgtest-dev libgmock-dev libbenchmark-dev clang libclang-rt-dev) ;;
  --engines) packages+=(slurmctld slurmd slurm-client munge python3-kubernetes python3-yaml)
    command -v kubectl >/dev/null 2>&1 || packages+=(kubernetes-client) ;; # two packages own /usr/bin/kubectl
  *) echo "install-deps: unknown option $1; use --tests, --fuzz or --engines" >&2; exit 2 ;;
esac

if ! command -v apt-get >/dev/null 2>&1; then
  echo "install-deps: no apt-get on this system; install the equivalents of:" >&2
  echo "  ${packages[*]}" >&2
  exit 1
fi

# Optional: without npm the build omits the studio and the page for viewing scenes, without
# libheif HEIC photos are refused.
wished=()
command -v npm >/dev/null 2>&1 || wished=(npm)
[ "$(dpkg-query -W -f '${db:Status-Status}' libheif-dev 2>/dev/null || true)" = installed ] || wished+=(libheif-dev)

missing=()
for package in "${packages[@]}"; do
  state=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  [ "$state" = installed ] || missing+=("$package")
done
if [ "${#missing[@]}" -eq 0 ] && [ "${#wished[@]}" -eq 0 ]; then
  exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null 2>&1; then
    [ "${#missing[@]}" -gt 0 ] || exit 0
    echo "install-deps: missing packages, whose installation needs root or sudo:" >&2
    echo "  ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi
install() {
  "${as_root[@]}" apt-get update -q
  echo "install-deps: installing $*"
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -q --no-install-recommends "$@"
}
if [ "${#missing[@]}" -gt 0 ]; then
  install "${missing[@]}"
fi
for package in ${wished[@]+"${wished[@]}"}; do
  install "$package" ||
    echo "install-deps: cannot install $package; building without it (npm: no studio, no scene viewer page; libheif-dev: no HEIC photos)" >&2
done
