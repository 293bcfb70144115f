#!/bin/sh
# build_with_pkg_config.sh PREFIX LIBDIR FOLDER: compiles the consumers by hand against an installed
# tree, with the shared and with the static library, and runs them.
set -eu
prefix=$1 libdir=$2 folder=$3
here=$(dirname "$0")
rm -rf "$folder"
mkdir -p "$folder"
export PKG_CONFIG_PATH="$prefix/$libdir/pkgconfig"
cflags=$(pkg-config --cflags vnreg)
libs=$(pkg-config --libs vnreg)
static_libs=$(pkg-config --static --libs vnreg | sed "s|-lvnreg|$prefix/$libdir/libvnreg.a|")
strict="-pedantic -Wall -Wextra -Werror"

# shellcheck disable=SC2086  # flags are lists
{
  cc -std=c99 $strict $cflags "$here/program/main.c" $libs -lm -o "$folder/c_shared"
  c++ -std=c++20 $strict $cflags "$here/program/main.cpp" $libs -o "$folder/cpp_shared"
  cc -std=c99 $strict $cflags "$here/program/main.c" $static_libs -o "$folder/c_static"
  c++ -std=c++20 $strict $cflags "$here/program/main.cpp" $static_libs -o "$folder/cpp_static"
}
for program in c_shared cpp_shared; do
  LD_LIBRARY_PATH="$prefix/$libdir" "$folder/$program"
done
for program in c_static cpp_static; do
  if ldd "$folder/$program" | grep libvnreg; then
    echo "$program is not static" >&2
    exit 1
  fi
  "$folder/$program"
done
