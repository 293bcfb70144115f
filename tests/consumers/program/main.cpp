// What a user's program does first: aligns a cloud with a moved copy of itself, and looks.
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>
#include <vnreg/vnreg.hpp>

int main() {
  // A twisted cone: no symmetry. The copy is turned by 90 degrees about z, and shifted.
  std::vector<std::array<float, 3>> source, target;
  for (int i = 0; i < 600; ++i) {
    const float t = 0.05f * static_cast<float>(i), r = 0.2f + 0.001f * static_cast<float>(i);
    source.push_back({r * std::cos(t), 0.6f * r * std::sin(t), 0.002f * static_cast<float>(i) * r});
    target.push_back({3 - source.back()[1], source.back()[0], source.back()[2] + 1});
  }
  vnreg::Registrar registrar{vnreg::Model::builtin(), {.threads = 1}};
  const vnreg::Result& result = registrar.align(source, registrar.prepare(target));
  const vnreg::Pose& T = result.T_target_source;
  std::printf("%s %s: %s, turned %.2f degrees\n", std::string(vnreg::version()).c_str(),
              std::string(vnreg::instruction_set()).c_str(),
              std::string(to_string(result.status)).c_str(),
              std::atan2(T[4], T[0]) * 180 / 3.14159265358979);
  try {
    vnreg::Model::load("/nowhere.vnr");
    return 2;
  } catch (const vnreg::Error& error) {
    if (error.code() != vnreg::ErrorCode::file_unreadable) return 3;
  }
  return result.has_pose && std::abs(T[4] - 1) < 0.01 && std::abs(T[3] - 3) < 0.02 ? 0 : 1;
}
