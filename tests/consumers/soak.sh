#!/bin/sh
# soak.sh BUILD FOLDER: what takes minutes. Installs the build into FOLDER, and runs against it a hundred
# thousand aligns, which must not make the process grow, and a thousand frames at 30 Hz, which must not
# miss a deadline. The frames run with real-time priority where that is allowed, so that other programs do
# not count, only vnreg.
set -eu
build=$1 folder=$2
here=$(cd "$(dirname "$0")" && pwd)
rm -rf "$folder"
for part in runtime development; do
  cmake --install "$build" --prefix "$folder/prefix" --component $part > /dev/null
done
configure() { # configure SOURCES BUILD
  cmake -S "$1" -B "$folder/$2" -G Ninja -DCMAKE_BUILD_TYPE=Release "-DCMAKE_PREFIX_PATH=$folder/prefix" \
    > /dev/null
}
configure "$here/find_package" consumers
configure "$here/../../examples" examples
cmake --build "$folder/consumers" --target endurance
cmake --build "$folder/examples" --target 03_stream_at_30_hz

"$folder/consumers/endurance" 100000
real_time=
if chrt -f 1 true 2> /dev/null; then real_time="chrt -f 1"; fi
$real_time "$folder/examples/03_stream_at_30_hz" 1000
