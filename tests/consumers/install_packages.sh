#!/bin/sh
# install_packages.sh BUILD FOLDER: makes the Debian packages, looks at what they say, unpacks them into
# FOLDER as dpkg would into /, runs the program, and builds and runs the consumers against that tree.
set -eu
build=$1 folder=$2
here=$(cd "$(dirname "$0")" && pwd)
rm -rf "$folder"
mkdir -p "$folder"
(cd "$folder" && cpack -G DEB --config "$build/CPackConfig.cmake" -B "$folder/packages" > cpack.log) ||
  { cat "$folder/cpack.log" >&2; exit 1; }

field() { # field NAME FIELD: of the package
  dpkg-deb --field "$folder"/packages/"$1"_*.deb "$2"
}
version=$(field vnreg Version)
library=$(cd "$folder/packages" && ls libvnreg[0-9]*_*.deb | sed 's/_.*//')
field "$library" Depends | grep -q 'libc6 (>= 2\.'
[ "$(field libvnreg-dev Depends)" = "$library (= $version)" ]
field vnreg Depends | grep -qF "$library (= $version)"
for name in "$library" libvnreg-dev vnreg; do
  dpkg-deb --extract "$folder"/packages/"$name"_*.deb "$folder/root"
  if dpkg-deb --contents "$folder"/packages/"$name"_*.deb | awk '{print $6}' | grep -Ev '^\./(usr/.*)?$'; then
    echo "$name has files outside of /usr" >&2
    exit 1
  fi
done

prefix="$folder/root/usr"
libdir=$(cd "$prefix" && dirname "$(ls lib/libvnreg.so lib/*/libvnreg.so 2> /dev/null)")
"$prefix/bin/vnreg" selftest | tail -n 1
# The program's description of itself is what it would print.
"$prefix/bin/vnreg" manual | cmp - "$prefix/share/man/man1/vnreg.1"
"$prefix/bin/vnreg" completion bash | cmp - "$prefix/share/bash-completion/completions/vnreg"
"$prefix/bin/vnreg" completion zsh | cmp - "$prefix/share/zsh/vendor-completions/_vnreg"
"$here/build_with_cmake.sh" "$here/find_package" "$folder/shared" \
  "-DCMAKE_PREFIX_PATH=$prefix" -DCOMPONENT=shared
"$here/build_with_pkg_config.sh" "$prefix" "$libdir" "$folder/pkg_config"
