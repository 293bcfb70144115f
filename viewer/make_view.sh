#!/usr/bin/env bash
# Joins the modules of src/ to one script: make_view.sh [OUTPUT], by default view.js beside this
# file. esbuild 0.17 (Debian's).
set -euo pipefail
cd "$(dirname "$0")"
esbuild src/main.js --bundle --format=iife --target=es2020 --charset=utf8 --log-level=warning \
  --banner:js="// Made from viewer/src by \`make viewer\`." --outfile="${1:-view.js}"
