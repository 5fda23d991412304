#!/bin/sh
# Builds the module in this folder and installs it, for which halcompile needs root; or: install.sh FOLDER, to build it there.
set -eu
[ $# -eq 0 ] || out=$(cd "$1" && pwd)
cd "$(dirname "$0")"
command -v halcompile >/dev/null || {
  echo "install.sh needs halcompile: the package linuxcnc-uspace-dev" >&2
  exit 1
}
build=$(mktemp -d)
trap 'rm -rf "$build"' EXIT
cp ./*.h pentapod_*.c "$build"
pins=pins_2.9.h
for include in "${EMC2_HOME:-/usr}/include" /usr/include/linuxcnc; do
  if grep -qs hal_pin_new_real "$include/hal.h"; then pins=pins_dev.h; fi
done
cp "$pins" "$build/pentapod_pins.h"
cd "$build"
if [ $# -gt 0 ]; then
  halcompile --compile pentapod_*.c > build.log 2>&1 || { cat build.log >&2; exit 1; }
  cp pentapod_*.so "$out"
elif [ "$(id -u)" = 0 ]; then
  halcompile --install pentapod_*.c
else
  sudo halcompile --install pentapod_*.c
fi
