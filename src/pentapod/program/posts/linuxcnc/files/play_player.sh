#!/bin/sh
# Plays the program in simulation, with changes of the override: play.sh 2:50 4:hold 6:resume 7:120 8:abort (seconds:percent).
# Writes played.txt: number, the lengths played, the lengths after the limits, row of the program, pace.
set -eu
cd "$(dirname "$0")"
command -v halcmd >/dev/null || { echo "play.sh needs LinuxCNC: the package linuxcnc-uspace" >&2; exit 1; }
if [ "${1:-}" != inside ]; then
  # Its own shared memory and no network: other LinuxCNCs on this host are not disturbed.
  if unshare --net --ipc --mount true 2>/dev/null; then exec unshare --net --ipc --mount sh play.sh inside "$@"; fi
  exec unshare --map-current-user --keep-caps --net --ipc --mount sh play.sh inside "$@"
fi
shift
for change in "$@"; do
  case "${change%%:*}" in ''|*[!0-9.]*) echo "not seconds:percent: $change" >&2; exit 2 ;; esac
  case "${change#*:}" in
    hold|resume|abort) ;;
    ''|*[!0-9.]*) echo "not a percentage, hold, resume or abort: $change" >&2; exit 2 ;;
  esac
done
scratch=$(mktemp -d)
chmod 1777 "$scratch"
trap 'halrun -U >/dev/null 2>&1 || true; rm -rf "$scratch"' EXIT
# Root may not run real-time parts as itself; for anyone else RTAPI_UID has no meaning.
export RTAPI_UID=65534 RTAPI_FIFO_PATH="$scratch/fifo" HOME="$scratch"
# The module is built here, and seen among LinuxCNC's own by this process alone.
modules=${EMC2_RTLIB_DIR:-/usr/lib/linuxcnc/modules}
cp -r "$modules" "$scratch/modules"
sh install.sh "$scratch/modules"
# Not by mount(8), which only root may call: 4096 is MS_BIND.
/usr/bin/python3 -c 'import ctypes, sys
sys.exit(ctypes.CDLL(None).mount(sys.argv[1].encode(), sys.argv[2].encode(), None, 4096, None) != 0)' \
  "$scratch/modules" "$modules" || { echo "play.sh may not show the module to LinuxCNC: sh install.sh first" >&2; exit 1; }
legs=$(grep -c '^addf leg' player.hal)
player=pentapod-player
echo "playing $(sed -n 's/^#define PENTAPOD_ROWS //p' player_numbers.h) setpoints"
halcmd -f player.hal
# The legs stand at the first row: it passes without limits, then the limits hold.
for leg in $(seq "$legs"); do halcmd setp "leg$leg.load" 1; done
halcmd start
grep -v '^#' coefficients.halstream | halstreamer &
feeder=$!
while [ "$(halcmd getp $player.ready)" != TRUE ]; do sleep 0.02; done
sleep 0.1
for leg in $(seq "$legs"); do halcmd setp "leg$leg.load" 0; done
halsampler -t > played.txt &
sampler=$!
halcmd setp sampler.0.enable 1
halcmd setp $player.run 1
begun=$(date +%s.%N)
for change in "$@"; do
  sleep "$(echo "$begun ${change%%:*} $(date +%s.%N)" | awk '{ d = $1 + $2 - $3; print (d > 0 ? d : 0) }')"
  case "${change#*:}" in
    hold) halcmd setp $player.hold 1 ;;
    resume) halcmd setp $player.hold 0 ;;
    abort) halcmd setp $player.abort 1 ;;
    *) halcmd setp $player.override "$(echo "${change#*:}" | awk '{ print $1 / 100 }')" ;;
  esac
done
while [ "$(halcmd getp $player.done)" != TRUE ] && [ "$(halcmd getp $player.stopped)" != TRUE ]; do sleep 0.05; done
ended=$(halcmd getp $player.done)
late=$(halcmd getp $player.underrun)
sleep 0.2
halcmd setp sampler.0.enable 0
sleep 0.3
kill -INT $sampler
kill $feeder 2>/dev/null || true
wait $sampler || true
halcmd stop
[ "$ended" = TRUE ] && echo "played to the end" || echo "aborted, standing on the path"
[ "$late" = FALSE ] || { echo "FAILED: the rows did not come in time" >&2; exit 1; }
awk '{ legs = (NF - 3) / 2; for (k = 2; k <= legs + 1; k++) { d = $k - $(k + legs); if (d < 0) d = -d; if (d > most) most = d } }
END { printf "played: the limits changed the lengths by at most %g mm\n", most; exit most > 0 }' played.txt || {
  echo "FAILED: limit3 clipped the lengths: they are not within the limits of the legs" >&2
  exit 1
}
