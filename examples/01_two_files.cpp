// The shortest program: two files in, the pose between them out.
//   01_two_files source.xyz target.xyz
#include <fstream>
#include <iostream>

#include <vnreg/vnreg.hpp>

using Points = std::vector<std::array<double, 3>>;

Points read_xyz(const char* path) {
  std::ifstream file(path);
  Points points;
  for (std::array<double, 3> p; file >> p[0] >> p[1] >> p[2];) points.push_back(p);
  return points;
}

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: 01_two_files source.xyz target.xyz\n";
    return 2;
  }
  const vnreg::Result result = vnreg::align(read_xyz(argv[1]), read_xyz(argv[2]));
  std::cout << "status " << to_string(result.status) << ", confidence " << result.confidence
            << ", overlap " << result.overlap << "\n";
  if (!result.has_pose) return 1;
  for (std::size_t row = 0; row < 4; ++row) {
    for (std::size_t column = 0; column < 4; ++column) {
      std::cout << result.T_target_source[4 * row + column] << (column < 3 ? ' ' : '\n');
    }
  }
}
