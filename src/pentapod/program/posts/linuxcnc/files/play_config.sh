#!/bin/sh
# Plays the program in simulation, without a screen; writes played.txt: number, the joints (mm), moving or not.
set -eu
cd "$(dirname "$0")"
command -v linuxcnc >/dev/null || { echo "play.sh needs LinuxCNC: the package linuxcnc-uspace" >&2; exit 1; }
if [ "${1:-}" != inside ]; then
  # linuxcncsvr listens on all addresses: no network. Its own shared memory as well.
  # Its own processes: LinuxCNC ends by killing every milltask of the host by name, those of a machine that runs too.
  own="--net --ipc --mount --pid --fork --kill-child --mount-proc"
  if unshare $own true 2>/dev/null; then exec unshare $own sh play.sh inside; fi
  exec unshare --map-current-user --keep-caps $own sh play.sh inside
fi
ip link set lo up
scratch=$(mktemp -d)
chmod 1777 "$scratch"
trap 'rm -rf "$scratch" headless.ini' EXIT
# Root may not run real-time parts as itself; for anyone else RTAPI_UID has no meaning.
export RTAPI_UID=65534 RTAPI_FIFO_PATH="$scratch/fifo" HOME="$scratch"
unset PYTHONPATH || true
if [ -f install.sh ]; then
  # The module is built here, and seen among LinuxCNC's own by this process alone.
  modules=${EMC2_RTLIB_DIR:-/usr/lib/linuxcnc/modules}
  cp -r "$modules" "$scratch/modules"
  sh install.sh "$scratch/modules"
  # Not by mount(8), which only root may call: 4096 is MS_BIND.
  /usr/bin/python3 -c 'import ctypes, sys
sys.exit(ctypes.CDLL(None).mount(sys.argv[1].encode(), sys.argv[2].encode(), None, 4096, None) != 0)' \
    "$scratch/modules" "$modules" || { echo "play.sh may not show the module to LinuxCNC: sh install.sh first" >&2; exit 1; }
fi
sed -e 's/^DISPLAY = .*/DISPLAY = .\/headless/' -e 's/^# HALFILE/HALFILE/' pentapod.ini > headless.ini
# To a file: the real-time process inherits a pipe and would keep it open.
echo "playing in real time; LinuxCNC's own words go to linuxcnc.log"
linuxcnc -r headless.ini > linuxcnc.log 2>&1 || true
if ! grep -qx DONE linuxcnc.log; then
  grep '^FAILED' linuxcnc.log >&2 || tail -n 20 linuxcnc.log >&2
  exit 1
fi
awk -v period="$(sed -n 's/^SERVO_PERIOD = //p' pentapod.ini)" '
$NF != 0 {
  moving++
  for (k = 2; k < NF; k++) {
    d = $k - 2 * one[k] + two[k]
    if (moving > 2 && d < 0) d = -d
    if (moving > 2 && d > most) most = d
    two[k] = one[k]
    one[k] = $k
  }
}
END {
  seconds = period / 1e9
  printf "played: the legs moved for %.3f s\n", moving * seconds
  printf "largest acceleration that was commanded: %.0f mm/s²\n", most / seconds / seconds
}' played.txt
