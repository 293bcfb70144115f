// endurance COUNT: aligns COUNT pairs of changing sizes, all statuses among them, and fails if the
// process has grown since the first hundred.
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <vector>
#include <vnreg/vnreg.hpp>

using Points = std::vector<std::array<double, 3>>;

static long resident_pages() {
  long size = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> size >> resident;
  return resident;
}

static Points shell(int count, double shift) {
  Points points;
  for (int i = 0; i < count; ++i) {
    const double t = 2.4 * i, z = 2.0 * i / count - 1, r = std::sqrt(1 - z * z);
    points.push_back(
        {r * std::cos(t), (0.6 + 0.2 * z) * r * std::sin(t) + shift, 0.4 * z + 0.1 * r});
  }
  return points;
}

int main(int, char** argv) {
  const long count = std::atol(argv[1]);
  vnreg::Registrar registrar{vnreg::Model::builtin(), {.threads = 1}};
  std::vector<Points> clouds;
  for (const int points : {10, 30, 60, 100}) clouds.push_back(shell(points, points));
  clouds.push_back(Points(50, {1, 2, 3}));
  const vnreg::PreparedCloud prepared = registrar.prepare(clouds[3]);
  long before = 0, with_pose = 0;
  for (long i = 0; i < count; ++i) {
    if (i == 100) before = resident_pages();
    const Points& source = clouds[static_cast<std::size_t>(i) % clouds.size()];
    const vnreg::Result& result =
        i % 3 == 0 ? registrar.align(source, prepared) : registrar.align(source, clouds[3]);
    with_pose += result.has_pose;
  }
  const long grown = (resident_pages() - before) * (sysconf(_SC_PAGESIZE) / 1024);
  std::printf("%ld aligns, %ld with a pose, resident memory grown by %ld kB\n", count, with_pose,
              grown);
  return grown == 0 && with_pose > 0 ? 0 : 1;
}
