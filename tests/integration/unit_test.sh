#!/usr/bin/env bash
# Checks the systemd unit: valid for systemd, with the required lines and a low exposure.
# Exit status 77: skipped.
#   tests/integration/unit_test.sh UNIT
set -euo pipefail
unit=$1
fail() {
  echo "unit_test: $1" >&2
  exit 1
}

for line in OOMPolicy=continue RestartPreventExitStatus=2 TasksMax= LimitNOFILE= TimeoutStartSec= \
  WatchdogSec= NoNewPrivileges=yes ProtectSystem=strict; do
  grep -q "^$line" "$unit" || fail "$unit has no line $line"
done
if ! command -v systemd-analyze >/dev/null; then
  echo "unit_test: skipped, systemd-analyze (package systemd) is not installed"
  exit 77
fi
# The program need not be installed.
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
sed 's|^ExecStart=.*|ExecStart=/bin/true|' "$unit" >"$folder/color3d.service"
said=$(systemd-analyze verify "$folder/color3d.service" 2>&1 | grep -i 'color3d.service' || true)
[ -z "$said" ] || fail "systemd rejects it: $said"
systemd-analyze security --offline=yes --threshold=20 "$folder/color3d.service" >"$folder/said" 2>&1 ||
  fail "the exposure is above 2.0: $(tail -n 1 "$folder/said")"
tail -n 1 "$folder/said"
echo "unit_test: ok"
