#!/bin/bash
# Brings the workers in Slurm's queue to a number; for color3d-server serve --scale-command.
#   scale.sh NUMBER
# Submits worker.sbatch for those that are missing, with the settings of worker.env, both beside this
# script. Cancels workers too many that wait for a node; running ones end by themselves
# (COLOR3D_IDLE_EXIT). Exit status 0: done.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
fail() {
  echo "scale.sh: $1" >&2
  exit 2
}
[[ ${1:-} =~ ^[0-9]{1,6}$ ]] || fail "'${1:-}' is no number of workers; run: scale.sh NUMBER"
wanted=$((10#$1))
[ -r "$here/worker.env" ] || fail "cannot read $here/worker.env"
# shellcheck source=deploy/slurm/worker.env
. "$here/worker.env"
[ -d "${COLOR3D_LOGS:-}" ] || fail "COLOR3D_LOGS=${COLOR3D_LOGS:-} in $here/worker.env is no folder"

workers() {
  squeue --me --noheader --array --name=color3d-worker --states="$1" --format=%i
}
waiting=$(workers PENDING,REQUEUED)
running=$(workers CONFIGURING,RUNNING,SUSPENDED)
read -ra waiting <<<"${waiting//$'\n'/ }"
read -ra running <<<"${running//$'\n'/ }"
missing=$((wanted - ${#waiting[@]} - ${#running[@]}))
if [ "$missing" -gt 0 ]; then
  sbatch --array="1-$missing" --output="$COLOR3D_LOGS/color3d-worker-%A_%a.log" --chdir="$COLOR3D_LOGS" \
    ${COLOR3D_SBATCH[@]+"${COLOR3D_SBATCH[@]}"} "$here/worker.sbatch" "$here/worker.env"
elif [ "$missing" -lt 0 ] && [ "${#waiting[@]}" -gt 0 ]; then
  surplus=$((-missing < ${#waiting[@]} ? -missing : ${#waiting[@]}))
  scancel --state=PENDING "${waiting[@]:0:$surplus}"
fi
