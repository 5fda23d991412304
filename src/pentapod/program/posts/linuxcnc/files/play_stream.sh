#!/bin/sh
# Plays legs.halstream in simulation; writes played.txt: number, the lengths streamed, the lengths after the limits.
set -eu
cd "$(dirname "$0")"
command -v halcmd >/dev/null || { echo "play.sh needs LinuxCNC: the package linuxcnc-uspace" >&2; exit 1; }
if [ "${1:-}" != inside ]; then
  # Its own shared memory and no network: other LinuxCNCs on this host are not disturbed.
  if unshare --net --ipc true 2>/dev/null; then exec unshare --net --ipc sh play.sh inside; fi
  exec unshare --map-current-user --keep-caps --net --ipc sh play.sh inside
fi
scratch=$(mktemp -d)
chmod 1777 "$scratch"
trap 'halrun -U >/dev/null 2>&1 || true; rm -rf "$scratch"' EXIT
# Root may not run real-time parts as itself; for anyone else RTAPI_UID has no meaning.
export RTAPI_UID=65534 RTAPI_FIFO_PATH="$scratch/fifo" HOME="$scratch"
rows=$(grep -vc '^#' legs.halstream)
legs=$(grep -c '^addf leg' stream.hal)
seconds=$(awk -v rows="$rows" '$2 == "period_s" { print rows * $4 }' legs.halstream)
echo "playing $rows setpoints, which takes $seconds s"
halcmd -f stream.hal
# The legs stand at the first row: it passes without limits, then the limits hold.
for leg in $(seq "$legs"); do halcmd setp leg$leg.load 1; done
grep -v '^#' legs.halstream | head -n 1 | halstreamer
halcmd setp streamer.0.enable 1
halcmd start
# The last leg in the thread's order: once it stands somewhere, all do, however late the thread begins.
while [ "$(halcmd getp "leg$legs.out")" = 0 ]; do sleep 0.02; done
halcmd setp streamer.0.enable 0
for leg in $(seq "$legs"); do halcmd setp leg$leg.load 0; done
grep -v '^#' legs.halstream | halstreamer &
feeder=$!
sleep 0.5
halcmd setp sampler.0.enable 1
halsampler -t -n $((rows + 400)) > played.txt &
sampler=$!
halcmd setp streamer.0.enable 1
wait $feeder
wait $sampler
halcmd stop
awk '{ legs = (NF - 1) / 2; for (k = 2; k <= legs + 1; k++) { d = $k - $(k + legs); if (d < 0) d = -d; if (d > most) most = d } }
END { printf "played: the limits changed the lengths by at most %g mm\n", most; exit most > 0 }' played.txt || {
  echo "FAILED: limit3 clipped the program: it is not within the limits of the legs" >&2
  exit 1
}
