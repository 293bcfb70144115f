// Clouds as they lie in your memory: nothing is copied. The same cloud in five layouts, five times
// the same pose.
#include <cstring>
#include <iostream>

#include "mug.hpp"

struct PointXYZI {  // like pcl::PointXYZI
  float x, y, z, padding;
  float intensity;
};

int main() {
  const Points target = mug(1024, 1);
  const Scan scan = scan_mug(1024, 2);
  vnreg::Registrar registrar{vnreg::Model::builtin(), {.threads = 1}};
  const auto show = [&](const char* layout, const vnreg::PointsView& points) {
    const vnreg::Result& result = registrar.align(points, target);
    std::cout << layout << ": " << to_string(result.status) << ", off by "
              << rotation_error_deg(result.T_target_source, scan.T_mug_scan) << " degrees\n";
  };

  // Anything that is contiguous and whose elements hold x, y, z goes in by itself.
  show("std::vector<std::array<float, 3>>", scan.points);

  std::vector<PointXYZI> records;
  for (const auto& p : scan.points) records.push_back({p[0], p[1], p[2], 1, 0.5f});
  show("records with other fields", records);

  // Else say where the first number is, how many points there are, and how far apart.
  std::vector<float> columns(3 * scan.points.size());  // all x, then all y, then all z
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      columns[axis * scan.points.size() + i] = scan.points[i][axis];
    }
  }
  show("three columns",
       {columns.data(), scan.points.size(), sizeof(float), scan.points.size() * sizeof(float)});

  constexpr std::size_t point_step = 22, offset = 6;  // like sensor_msgs::PointCloud2
  std::vector<std::uint8_t> message(point_step * scan.points.size());
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    std::memcpy(&message[point_step * i + offset], scan.points[i].data(), 12);
  }
  show("bytes of a message",
       {reinterpret_cast<const float*>(&message[offset]), scan.points.size(), point_step});

  std::vector<double> packed;
  for (const auto& p : scan.points) packed.insert(packed.end(), p.begin(), p.end());
  show("doubles in a row", {packed.data(), scan.points.size()});
}
