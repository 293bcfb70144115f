// The encoders of both networks as a whole, on both clouds of a pair, with the time that the engine
// itself takes for the stage. Bytes are the weights and the points: products bound them.
//
//   encode_paper/C/N/threads, encode_vnreg/N/threads
#include <algorithm>

#include "clouds.hpp"
#include "engine/model_data.hpp"
#include "network_work.hpp"
#include "random_model.hpp"
#include "roofline.hpp"

namespace vnreg::bench {
namespace {

using test::Points;

struct ShapePair {
  explicit ShapePair(std::size_t points) {
    test::Random random(1);
    source = test::shape(points, random);
    target = test::moved(test::shape(points, random), test::random_motion(random, 1));
  }
  Points source, target;
};

Options options_for(Mode mode, std::size_t points, int threads) {
  return {.mode = mode,
          .threads = threads,
          .max_points = static_cast<int>(std::max(points, std::size_t{64}))};
}

void time_encoder(benchmark::State& state, const Model& model, const Options& options,
                  const ShapePair& pair, const Work& work) {
  Registrar registrar(model, options);
  registrar.align(pair.source, pair.target);
  for (auto _ : state) {
    state.SetIterationTime(1e-3 * registrar.align(pair.source, pair.target).ms.encode);
  }
  count(state, work, options.threads);
}

/// Arguments: C, N, threads; L = C / 2.
void encode_paper(benchmark::State& state) {
  const auto channels = static_cast<std::uint64_t>(state.range(0));
  const auto points = static_cast<std::size_t>(state.range(1));
  const Model model = test::random_model({.global = channels,
                                          .local = channels / 2,
                                          .descriptor = 64,
                                          .pair = 32,
                                          .significance = {64, 32},
                                          .neighbours = 20})
                          .build();
  const double flops = 2 * static_cast<double>(points) * paper_flops_per_point(model.data().arch);
  // About 35 C^2 weights.
  const double bytes =
      4 * (35.0 * static_cast<double>(channels * channels) + 2 * 3 * static_cast<double>(points));
  time_encoder(state, model, options_for(Mode::paper, points, static_cast<int>(state.range(2))),
               ShapePair(points), {flops, bytes});
}
BENCHMARK(encode_paper)
    ->Args({128, 1024, 1})
    ->Args({128, 1024, 2})
    ->Args({48, 1024, 1})
    ->Args({32, 1024, 1})
    ->Args({128, 256, 1})
    ->Args({128, 4096, 1})
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

struct Places {
  explicit Places(const Stage& points) : xyz(points.values) {}
  double squared(std::size_t i, std::size_t j) const {
    const double dx = xyz[3 * i] - xyz[3 * j], dy = xyz[3 * i + 1] - xyz[3 * j + 1],
                 dz = xyz[3 * i + 2] - xyz[3 * j + 2];
    return dx * dx + dy * dy + dz * dz;
  }
  const std::vector<double>& xyz;
};

/// What the engine recorded of one cloud.
NeighbourhoodPairs count_pairs(const Registrar& registrar, const std::string& side,
                               const detail::DescriptorArchitecture& arch) {
  const Places places(test::stage(registrar, side + ".points"));
  const Stage& encoded = test::stage(registrar, side + ".encoded");
  std::vector<bool> is_encoded(places.xyz.size() / 3, false);
  for (const double point : encoded.values) is_encoded[static_cast<std::size_t>(point)] = true;
  NeighbourhoodPairs pairs{};
  const auto within = [](double squared, double radius) { return squared < radius * radius; };
  for (const double point : encoded.values) {
    for (std::size_t j = 0; j < is_encoded.size(); ++j) {
      const double squared = places.squared(static_cast<std::size_t>(point), j);
      for (const float r : arch.moment_radii) {
        pairs.moments += within(squared, static_cast<double>(r)) ? 1 : 0;
      }
      if (!is_encoded[j]) continue;
      pairs.local += within(squared, static_cast<double>(arch.local_radius)) ? 1 : 0;
      pairs.context += within(squared, static_cast<double>(arch.context_radius)) ? 1 : 0;
    }
  }
  return pairs;
}

double vnreg_pair_flops(const Model& model, Options options, const ShapePair& pair) {
  options.record_stages = true;
  Registrar registrar(model, options);
  registrar.align(pair.source, pair.target);
  const detail::DescriptorArchitecture& arch = model.data().descriptor_model->arch;
  double flops = 0;
  for (const std::string side : {"source", "target"}) {
    const auto encoded = test::stage(registrar, side + ".encoded").values.size();
    flops += vnreg_flops(arch, static_cast<double>(encoded), count_pairs(registrar, side, arch));
  }
  return flops;
}

/// The built-in model. Arguments: N, threads.
void encode_vnreg(benchmark::State& state) {
  const auto points = static_cast<std::size_t>(state.range(0));
  const Model model = Model::builtin();
  const Options options = options_for(Mode::coarse, points, static_cast<int>(state.range(1)));
  const ShapePair pair(points);
  const double bytes = 4 * (71e3 + 2 * 3 * static_cast<double>(points));
  time_encoder(state, model, options, pair, {vnreg_pair_flops(model, options, pair), bytes});
}
BENCHMARK(encode_vnreg)
    ->Args({512, 1})
    ->Args({1024, 1})
    ->Args({1024, 2})
    ->Args({4096, 1})
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace vnreg::bench
