#!/usr/bin/env bash
# Checks that the programs of `cmake --install` run: versions agree, and the server finds its worker.
#   tests/integration/install_test.sh BUILD_DIR VERSION
set -euo pipefail
build=$1
version=$2
prefix=$(mktemp -d)
server=
finish() {
  [ -z "$server" ] || kill "$server" 2>/dev/null || true
  [ -z "$server" ] || wait "$server" 2>/dev/null || true
  rm -rf "$prefix"
}
trap finish EXIT
fail() {
  echo "install_test: $1" >&2
  exit 1
}

cmake --install "$build" --prefix "$prefix" >/dev/null
for program in color3d color3d-server color3d-worker; do
  said=$("$prefix/bin/$program" --version)
  [ "$said" = "$version" ] || fail "$program --version prints '$said', not $version"
done
for file in share/doc/color3d/README.md share/doc/color3d/deploy/README.md \
  share/doc/color3d/deploy/systemd/color3d.service share/color3d/proto/color3d/v1/job.proto; do
  [ -s "$prefix/$file" ] || fail "$file was not installed"
done

# The studio, where it is built, has an entry in the menu that starts the installed program.
if "$prefix/bin/color3d" studio --help >/dev/null 2>&1; then
  entry=$prefix/share/applications/color3d-studio.desktop
  grep -qF "Exec=\"$prefix/bin/color3d\" studio --from-menu %f" "$entry" || fail "the menu has no entry of the studio"
  [ -s "$prefix/share/icons/hicolor/scalable/apps/color3d-studio.svg" ] || fail "the studio's icon was not installed"
  if command -v desktop-file-validate >/dev/null; then
    said=$(desktop-file-validate "$entry") || fail "$said"
  fi
fi

"$prefix/bin/color3d-server" serve --listen 127.0.0.1:0 --data-dir "$prefix/data" \
  --port-file "$prefix/address" >"$prefix/log" 2>&1 &
server=$!
for _ in $(seq 100); do
  [ ! -s "$prefix/address" ] || break
  sleep 0.1
done
[ -s "$prefix/address" ] || fail "the installed server did not start: $(tail -n 3 "$prefix/log")"
info=$("$prefix/bin/color3d" --server "$(cat "$prefix/address")" server info)
grep -q "$version" <<<"$info" || fail "server info does not print $version: $info"
echo "install_test: ok"
