#!/usr/bin/env bash
# Lists the Debian packages that the installed programs need, one per line, on the build machine.
#   deploy/runtime-packages.sh PREFIX    as given to cmake --install
set -euo pipefail
prefix=${1:?usage: deploy/runtime-packages.sh PREFIX}
libraries=$(ldd "$prefix"/bin/* | awk '$2 == "=>" && $3 ~ /^\// {print $3}' | sort -u)
{
  # Files that dpkg lists under /usr/lib may be under /lib, and vice versa.
  for library in $libraries; do
    file=${library#/usr}
    dpkg -S "$file" 2>/dev/null || dpkg -S "/usr$file" 2>/dev/null || dpkg -S "$(readlink -f "$library")"
  done | cut -d: -f1
  # BLAS is selected by an alternative; COLMAP and certificates are found at run time.
  printf '%s\n' libopenblas0-pthread colmap ca-certificates
} | sort -u
