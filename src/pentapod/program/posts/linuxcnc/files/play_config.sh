#!/bin/sh
# Plays the program in simulation, without a screen; writes played.txt: number, five joints (mm), moving or not.
set -eu
cd "$(dirname "$0")"
command -v linuxcnc >/dev/null || { echo "play.sh needs LinuxCNC: the package linuxcnc-uspace" >&2; exit 1; }
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
echo "playing in real time; LinuxCNC's own words go to linuxcnc.log"
linuxcnc -r headless.ini > linuxcnc.log 2>&1 || true
if ! grep -qx DONE linuxcnc.log; then
  grep '^FAILED' linuxcnc.log >&2 || tail -n 20 linuxcnc.log >&2
  exit 1
fi
echo "played: the legs moved for $(awk -v period="$(sed -n 's/^SERVO_PERIOD = //p' pentapod.ini)" \
  '$7 != 0 { moving++ } END { printf "%.3f", moving * period / 1e9 }' played.txt) s"
