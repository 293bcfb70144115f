#!/bin/sh
# check_symbols.sh LIBRARY: the library refers to nothing that prints, ends the process or reads the
# environment, and shows nothing but the API.
set -eu
library=$1
case $library in
  *.a) dynamic= ;;
  *) dynamic=-D ;;
esac
loud='v?f?printf|__v?f?printf_chk|f?puts|f?putc|putchar|fwrite|write|perror|syslog'
loud="$loud|_ZSt4cout|_ZSt4cerr|_ZSt4clog|abort|_?exit|_Exit|quick_exit|__assert_fail|raise|kill"
loud="$loud|getenv|secure_getenv"
if nm $dynamic --undefined-only "$library" | awk '{print $NF}' | sed 's/@.*//' | grep -Ex "$loud"; then
  echo "$library must not refer to these" >&2
  exit 1
fi
api='vnreg_[a-z0-9_]+|_ZNK?5vnreg.*|_ZT[ISV]N5vnreg5ErrorE'
symbols=$(nm $dynamic --defined-only --extern-only "$library" | awk 'NF == 3 {print $3}' | sed 's/@.*//')
[ "$(echo "$symbols" | wc -l)" -gt 40 ]
if echo "$symbols" | grep -Exv "$api"; then
  echo "$library must not show these" >&2
  exit 1
fi
if echo "$symbols" | grep -E '6detail|7kernels|12model_format'; then
  echo "$library must not show its internals" >&2
  exit 1
fi
