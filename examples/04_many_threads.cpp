// Many threads share one model and one prepared cloud; each has a registrar of its own. The same
// for a batch is one call.
#include <iostream>
#include <thread>

#include "mug.hpp"

int main() {
  constexpr std::size_t threads = 4, scans_per_thread = 8;
  const vnreg::Model model = vnreg::Model::builtin();
  const vnreg::Options options{.threads = 1};
  const vnreg::PreparedCloud part = vnreg::Registrar(model, options).prepare(mug(1024, 1));

  std::vector<Scan> scans;
  for (std::uint64_t i = 0; i < threads * scans_per_thread; ++i) {
    scans.push_back(scan_mug(1024, 200 + i));
  }

  std::vector<vnreg::Result> results(scans.size());
  std::vector<std::thread> workers;
  for (std::size_t worker = 0; worker < threads; ++worker) {
    workers.emplace_back([&, worker] {
      vnreg::Registrar registrar(model, options);
      for (std::size_t i = worker; i < scans.size(); i += threads) {
        results[i] = registrar.align(scans[i].points, part);
      }
    });
  }
  for (std::thread& worker : workers) worker.join();

  std::vector<vnreg::CloudPair> pairs;
  for (const Scan& scan : scans) pairs.push_back({scan.points, part});
  std::vector<vnreg::Result> batch(pairs.size());
  vnreg::BatchRegistrar(model, {.threads = threads}).align_many(pairs, batch);

  std::size_t right = 0, equal = 0;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    right += rotation_error_deg(results[i].T_target_source, scans[i].T_mug_scan) < 5;
    equal += results[i].T_target_source == batch[i].T_target_source;
  }
  std::cout << right << " of " << scans.size() << " poses within 5 degrees; " << equal
            << " equal to the last bit in the batch\n";
  return equal == scans.size() ? 0 : 1;
}
