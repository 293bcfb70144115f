// Empty. It tells CMake that the static library, whose one object is joined by hand, has to be
// linked as C++, in programs that are written in C, too.
