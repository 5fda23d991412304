#!/bin/sh
# Plays the program in simulation, without a screen; writes played.txt: number, five joints (mm), moving or not.
set -eu
cd "$(dirname "$0")"
if [ "${1:-}" != inside ]; then
  # linuxcncsvr listens on all addresses: no network. Its own shared memory as well.
  if unshare --net --ipc true 2>/dev/null; then exec unshare --net --ipc sh play.sh inside; fi
  exec unshare --map-current-user --keep-caps --net --ipc sh play.sh inside
fi
ip link set lo up
scratch=$(mktemp -d)
chmod 1777 "$scratch"
trap 'rm -rf "$scratch" headless.ini' EXIT
# Root may not run real-time parts as itself; for anyone else RTAPI_UID has no meaning.
export RTAPI_UID=65534 RTAPI_FIFO_PATH="$scratch/fifo" HOME="$scratch"
unset PYTHONPATH || true
sed -e 's/^DISPLAY = .*/DISPLAY = .\/headless/' -e 's/^# HALFILE/HALFILE/' pentapod.ini > headless.ini
# To a file: the real-time process inherits a pipe and would keep it open.
linuxcnc -r headless.ini > linuxcnc.log 2>&1
