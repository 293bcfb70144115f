// A fixed model against a stream of scans, with a deadline. The model is prepared once; nothing is
// allocated in the loop; a frame that would be late is given up in time.
//   03_stream_at_30_hz [frames] [hertz]
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <thread>

#include "mug.hpp"

using Clock = std::chrono::steady_clock;

int main(int argc, char** argv) {
  const int frames = argc > 1 ? std::atoi(argv[1]) : 1000;
  const double period_ms = 1000 / (argc > 2 ? std::atof(argv[2]) : 30.0);

  // What is left of the period is for the rest of the loop.
  vnreg::Registrar registrar{vnreg::Model::builtin(),
                             {.threads = 1, .time_budget_ms = 0.9 * period_ms}};
  const vnreg::PreparedCloud model = registrar.prepare(mug(1024, 1));
  std::vector<Scan> camera;
  for (std::uint64_t i = 0; i < 64; ++i) camera.push_back(scan_mug(1024, 100 + i));

  int missed = 0, timed_out = 0, right = 0;
  double slowest_ms = 0, sum_ms = 0;
  const auto period = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double, std::milli>(period_ms));
  auto frame_time = Clock::now();
  for (int frame = 0; frame < frames; ++frame) {
    std::this_thread::sleep_until(frame_time);
    const auto deadline = frame_time + period;
    const Scan& scan = camera[static_cast<std::size_t>(frame) % camera.size()];

    const vnreg::Result& result = registrar.align(scan.points, model);

    if (Clock::now() > deadline) ++missed;
    if (result.status == vnreg::Status::timed_out) ++timed_out;
    if (result.has_pose && rotation_error_deg(result.T_target_source, scan.T_mug_scan) < 5) ++right;
    slowest_ms = std::max(slowest_ms, result.ms.total);
    sum_ms += result.ms.total;
    frame_time = deadline;
  }
  std::cout << frames << " frames of " << period_ms << " ms: " << missed << " deadlines missed, "
            << timed_out << " given up, " << right << " poses within 5 degrees, mean "
            << sum_ms / frames << " ms, slowest " << slowest_ms << " ms\n";
  return missed > 0 ? 1 : 0;
}
