#!/usr/bin/env bash
# The Debian packages that installed programs need to run, one a line, on the machine that built them.
#   deploy/runtime-packages.sh PREFIX    as given to cmake --install
set -euo pipefail
prefix=${1:?usage: deploy/runtime-packages.sh PREFIX}
libraries=$(ldd "$prefix"/bin/* | awk '$2 == "=>" && $3 ~ /^\// {print $3}' | sort -u)
{
  # What dpkg lists under /usr/lib may be found under /lib, and the other way round.
  for library in $libraries; do
    file=${library#/usr}
    dpkg -S "$file" 2>/dev/null || dpkg -S "/usr$file" 2>/dev/null || dpkg -S "$(readlink -f "$library")"
  done | cut -d: -f1
  # BLAS is chosen by an alternative, COLMAP and certificates are looked for at run time.
  printf '%s\n' libopenblas0-pthread colmap ca-certificates
} | sort -u
