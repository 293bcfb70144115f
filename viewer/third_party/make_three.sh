#!/usr/bin/env bash
# Makes three.js: the parts of the npm package `three` that the viewer uses, in one file, with its
# licence. Needed only to change the version or the parts; npm, esbuild 0.17 (Debian's).
set -euo pipefail
cd "$(dirname "$0")"
version=0.187.0
sha512=Qiu7R+Cmh8CstZsY1uJOSWnVlfo7ZtNLV7mF8Jltk3LB3AtDu9cRZlcnRKkAk8Y4z6KKw35z7Y7Urd7jWY8etA==

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
npm pack --silent --pack-destination "$scratch" "three@$version" > /dev/null
found=$(openssl dgst -sha512 -binary "$scratch/three-$version.tgz" | base64 -w0)
[ "$found" = "$sha512" ] || { echo "three@$version: expected sha512 $sha512, found $found" >&2; exit 1; }
mkdir "$scratch/node_modules"
tar -xzf "$scratch/three-$version.tgz" -C "$scratch"
mv "$scratch/package" "$scratch/node_modules/three"
cp three_parts.js "$scratch"
esbuild "$scratch/three_parts.js" --bundle --minify --format=iife --global-name=THREE \
  --target=es2020 --legal-comments=none --log-level=warning \
  --banner:js="/* three.js $version
$(cat "$scratch/node_modules/three/LICENSE")
*/" --outfile=three.js
